//! The splined camera as mrcal's `LENSMODEL_SPLINED_STEREOGRAPHIC`.
//!
//! The configuration is in the name: `order=3_Nx=…_Ny=…_fov_x_deg=…`. `intrinsics` are `fx fy cx cy`, then Δu_x and Δu_y of each control
//! point, row by row. Order 2 is not read. (mrcal's documentation, "Lens models"; the program itself was not run.)

use super::{literal, text_of};
use crate::calib::{
    Error, Result,
    format::node::size_px,
    lens::Lens as _,
    splined::{Layout, Splined},
};

/// What the name of the model begins with.
const NAME: &str = "LENSMODEL_SPLINED_STEREOGRAPHIC";

/// Writes a splined camera as a `.cameramodel`; every number reads back to the same bits.
pub fn write_splined(camera: &Splined) -> String {
    let Layout { knots: [columns, rows], fov_x_deg } = camera.layout();
    let model = format!("{NAME}_order=3_Nx={columns}_Ny={rows}_fov_x_deg={fov_x_deg}");
    let core = camera.intrinsics();
    text_of(&model, core.iter().chain(camera.surface().iter().flatten()), camera.size_px(), None)
}

/// Whether a text is meant for [`read_splined`], also where it is damaged.
pub fn is_splined(text: &str) -> bool {
    text.contains(NAME)
}

/// Reads a `.cameramodel` that holds a splined camera.
///
/// # Errors
/// [`Error::Unsupported`] for other models and for order 2, [`Error::Invalid`] for a damaged file.
pub fn read_splined(text: &str) -> Result<Splined> {
    let root = literal(text)?;
    let model = root
        .text_at("lensmodel")
        .ok_or_else(|| Error::Invalid("the field lensmodel is missing".to_owned()))?;
    let Some(configuration) = model.strip_prefix(NAME) else {
        return Err(Error::Unsupported(format!("{model} is no splined model: {NAME}_order=3_… is expected")));
    };
    let value = |key: &str| -> Result<usize> {
        let (_, rest) = configuration.split_once(&format!("_{key}=")).unwrap_or_default();
        let digits = rest.split('_').next().unwrap_or_default();
        digits.parse().map_err(|_| Error::Invalid(format!("lensmodel: {key} is missing in {model}")))
    };
    if value("order")? != 3 {
        return Err(Error::Unsupported(format!("{model}: only cubic splines (order=3) are read")));
    }
    let fov_x_deg = u32::try_from(value("fov_x_deg")?).unwrap_or(u32::MAX);
    let layout = Layout { knots: [value("Nx")?, value("Ny")?], fov_x_deg };
    layout.validate()?;
    let values = root.get("intrinsics")?.numbers("intrinsics")?;
    let (Some(core), Some(rest)) = (values.first_chunk::<4>(), values.get(4..)) else {
        return Err(Error::Invalid("intrinsics must begin with fx, fy, cx, cy".to_owned()));
    };
    let (pairs, odd) = rest.as_chunks::<2>();
    if !odd.is_empty() || pairs.len() != layout.knots[0] * layout.knots[1] {
        return Err(Error::Invalid(format!(
            "intrinsics has {} numbers, {model} needs {}",
            values.len(),
            4 + 2 * layout.knots[0] * layout.knots[1]
        )));
    }
    let [w, h] = root.array_at("imagersize")?;
    Splined::new(size_px(w, h)?, layout, *core, pairs.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Splined {
        let layout = Layout { knots: [6, 5], fov_x_deg: 100 };
        let surface = (0..30).map(|k| [0.01 * f64::from(k).sin(), -0.02 / (1.0 + f64::from(k))]).collect();
        Splined::new([640, 480], layout, [400.0, 401.5, 320.25, 238.125], surface).unwrap()
    }

    #[test]
    fn every_bit_comes_back() {
        let text = write_splined(&camera());
        assert!(text.contains("'LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=6_Ny=5_fov_x_deg=100'"), "{text}");
        assert!(text.contains("'imagersize': [ 640, 480,]"), "{text}");
        assert_eq!(read_splined(&text).unwrap(), camera());
        // The keys of the configuration may stand in any order.
        let other = text.replace("order=3_Nx=6_Ny=5_fov_x_deg=100", "fov_x_deg=100_Ny=5_Nx=6_order=3");
        assert_eq!(read_splined(&other).unwrap(), camera());
    }

    #[test]
    fn what_cannot_be_read_is_told() {
        let text = write_splined(&camera());
        for (from, to, says) in [
            ("order=3", "order=2", "order=3"),
            ("Nx=6", "Nx=7", "64 numbers"),
            ("Nx=6", "Nx=3", "control points"),
            ("_Ny=5", "", "Ny is missing"),
            ("fov_x_deg=100", "fov_x_deg=400", "field of view"),
            ("SPLINED_STEREOGRAPHIC", "CAHVOR", "no splined model"),
            ("640, 480", "0, 480", ""),
        ] {
            let error = read_splined(&text.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(says), "{to}: {error}");
        }
        for end in (0..text.len()).step_by(17).filter(|end| text.is_char_boundary(*end)) {
            assert!(read_splined(&text[..end]).is_err());
        }
    }
}
