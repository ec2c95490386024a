//! The residual map in this program's own JSON.

use super::node::Node;
use crate::calib::{Error, Result, json, residual::Field};

/// `residual_map` of a file that says nothing else about it, as JSON.
pub(super) fn written(field: &Field) -> String {
    format!("{{\"field\": {}}}", json::text(field).trim_end())
}

/// From `residual_map`; none where it has no field, because that was not worth having.
///
/// # Errors
/// [`Error::Invalid`] with the field that is wrong.
pub(super) fn read(map: &Node) -> Result<Option<Field>> {
    let Some(field) = map.find("field") else { return Ok(None) };
    let knots: [f64; 2] = field.array_at("knots")?;
    if !knots.iter().all(|n| n.fract() == 0.0 && (0.0..1e6).contains(n)) {
        return Err(Error::Invalid(format!(
            "residual_map: knots are {knots:?}: two whole numbers are expected"
        )));
    }
    let numbers = field.get("offsets_px")?.numbers("offsets_px")?;
    let (pairs, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() {
        return Err(Error::Invalid("residual_map: offsets_px must hold pairs [dx, dy]".to_owned()));
    }
    let [origin, step] = [field.array_at("origin_px")?, field.array_at("step_px")?];
    Field::new(origin, step, knots.map(|n| n as usize), pairs.to_vec()).map(Some)
}
