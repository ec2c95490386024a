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
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    use crate::calib::observation::Corner;

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Row {
        Full(u32, f64, f64, f64),
        Bare(u32, f64, f64),
    }

    pub(in super::super) fn serialize<S: Serializer>(corners: &[Corner], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(corners.iter().map(|c| Row::Full(c.index, c.px.x, c.px.y, c.sigma_px)))
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<Corner>, D::Error> {
        let rows = Vec::<Row>::deserialize(d)
            .map_err(|_| de::Error::custom("corners must be a list of [index, x_px, y_px, sigma_px]"))?;
        let corner = |row| {
            let (index, x, y, sigma_px) = match row {
                Row::Full(index, x, y, sigma) => (index, x, y, sigma),
                Row::Bare(index, x, y) => (index, x, y, 0.0),
            };
            Corner { index, px: Vector2::new(x, y), sigma_px }
        };
        Ok(rows.into_iter().map(corner).collect())
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
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    use crate::calib::{
        camera::{Camera, Model},
        named::Named,
    };

    #[derive(Clone, Serialize, Deserialize)]
    struct One {
        image_size_px: [u32; 2],
        model: Model,
        camera_matrix: Named<f64>,
        #[serde(default)]
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

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Camera, D::Error> {
        let one = One::deserialize(d)?;
        let values: Vec<(&str, f64)> =
            one.camera_matrix.iter().chain(one.distortion.iter()).map(|(n, v)| (n, *v)).collect();
        Camera::from_named(one.model, one.image_size_px, &values).map_err(de::Error::custom)
    }
}
