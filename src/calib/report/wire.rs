//! How single fields of the report look in JSON.

/// A board size as text, or null.
pub(super) mod board {
    use serde::{Deserialize, Deserializer, Serializer, de};

    use crate::calib::target::BoardSize;

    pub(in super::super) fn serialize<S: Serializer>(
        size: &Option<BoardSize>,
        s: S,
    ) -> Result<S::Ok, S::Error> {
        match size {
            Some(size) => s.collect_str(size),
            None => s.serialize_none(),
        }
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        d: D,
    ) -> Result<Option<BoardSize>, D::Error> {
        Option::<String>::deserialize(d)?.map(|t| t.parse().map_err(de::Error::custom)).transpose()
    }
}

/// Corners as `[index, x_px, y_px, sigma_px]`; σ may be missing.
pub(super) mod corners {
    use nalgebra::Vector2;
    use serde::{Deserialize, Deserializer, Serializer, de};
    use serde_json::Number;

    use crate::calib::observation::Corner;

    pub(in super::super) fn serialize<S: Serializer>(corners: &[Corner], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(corners.iter().map(|c| (c.index, c.px.x, c.px.y, c.sigma_px)))
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<Corner>, D::Error> {
        let wrong = || de::Error::custom("corners must be a list of [index, x_px, y_px, sigma_px]");
        let rows = Vec::<Vec<Number>>::deserialize(d).map_err(|_| wrong())?;
        let corner = |row: &Vec<Number>| {
            let (index, x, y, sigma_px) = match &row[..] {
                [index, x, y, sigma] => (index, x, y, sigma.as_f64()?),
                [index, x, y] => (index, x, y, 0.0),
                _ => return None,
            };
            let index = u32::try_from(index.as_u64()?).ok()?;
            Some(Corner { index, px: Vector2::new(x.as_f64()?, y.as_f64()?), sigma_px })
        };
        rows.iter().map(corner).collect::<Option<_>>().ok_or_else(wrong)
    }
}

/// A matrix as a list of its rows.
pub(super) mod matrix {
    use nalgebra::DMatrix;
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub(in super::super) fn serialize<S: Serializer>(matrix: &DMatrix<f64>, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(matrix.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()))
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<DMatrix<f64>, D::Error> {
        let rows = Vec::<Vec<f64>>::deserialize(d)?;
        if rows.iter().any(|row| row.len() != rows.len()) {
            return Err(de::Error::custom("covariance must be square"));
        }
        Ok(DMatrix::from_fn(rows.len(), rows.len(), |i, j| rows[i][j]))
    }
}

/// Comparisons as an object by parameter.
pub(super) mod by_name {
    use serde::{Deserialize, Deserializer, Serializer};

    use crate::calib::{named::Named, stats::Comparison};

    pub(in super::super) fn serialize<S: Serializer>(list: &[Comparison], s: S) -> Result<S::Ok, S::Error> {
        s.collect_map(list.iter().map(|c| (&c.name, c)))
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        d: D,
    ) -> Result<Vec<Comparison>, D::Error> {
        Ok(Named::deserialize(d)?.0.into_iter().map(|(_, c)| c).collect())
    }
}

/// A camera as fields beside others, and once more as the only item of the list `cameras`.
pub(super) mod camera {
    use serde::{Serialize, Serializer};

    use crate::calib::{
        camera::{Camera, Model},
        named::Named,
    };

    #[derive(Clone, Serialize)]
    struct One {
        image_size_px: [u32; 2],
        model: Model,
        camera_matrix: Named<f64>,
        distortion: Named<f64>,
    }

    #[derive(Serialize)]
    struct Flat {
        #[serde(flatten)]
        one: One,
        cameras: [One; 1],
    }

    pub(in super::super) fn serialize<S: Serializer>(camera: &Camera, s: S) -> Result<S::Ok, S::Error> {
        let named = || camera.spec().params.iter().zip(&camera.params).map(|(p, v)| (p.name.to_owned(), *v));
        let one = One {
            image_size_px: camera.size_px,
            model: camera.model,
            camera_matrix: named().take(4).collect(),
            distortion: named().skip(4).collect(),
        };
        Flat { cameras: [one.clone()], one }.serialize(s)
    }
}
