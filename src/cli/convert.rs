//! `straightedge convert`: a camera file in another format, scaled or cropped.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    str::FromStr,
};

use super::{files, print, say};
use crate::calib::{
    Error, Result,
    camera::Model,
    format::{self, Destination, Export},
    number::within_px,
};
use crate::job::store;

/// Convert a camera file, refit it to another model, scale or crop the camera
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Camera file of any format: opencv, ros, kalibr, colmap, nerfstudio, straightedge, mrcal, matlab, metashape, basalt,
    /// gyroflow, opensfm
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write; the format is named before a colon, or follows from the extension
    #[arg(value_name = "[FORMAT:]OUT")]
    output: Destination,
    /// The camera of the same pictures cropped to this rectangle, px of the original from its top-left pixel
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true)]
    crop: Option<Crop>,
    /// The camera of the same pictures resized by this factor, after the crop
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    scale: Option<f64>,
    /// The camera of another model that follows it best over the picture; the error is told
    #[arg(long, value_name = "MODEL")]
    model: Option<Model>,
}

/// `x,y,width,height`.
#[derive(Clone, Copy, Debug)]
struct Crop([u32; 4]);

impl FromStr for Crop {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y, w, h]) => Ok(Self([x, y, w, h])),
            _ => Err(Error::Invalid(format!(
                "\"{text}\" is not a crop: write x,y,width,height in whole px, for example 100,50,640,480"
            ))),
        }
    }
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let Args { input, output, crop, scale, model } = args;
    let path = Path::new(&output.path);
    files::may_write(path, [input.as_path()])?;
    let mut file = files::camera(input)?;
    if let Some(Crop(rectangle)) = crop {
        file = file.cropped(*rectangle)?;
    }
    if let Some(scale) = scale {
        file = file.scaled(*scale)?;
    }
    if let Some(model) = model {
        let (camera, error) = file.camera.refit(*model)?;
        file.notes.push(format!("{} for {}: {error}", model.spec().title, file.camera.spec().title));
        // What was known of the terms is not known of others.
        file.evidence.sigma.clear();
        (file.evidence.covariance, file.evidence.free) = (None, Vec::new());
        file.camera = camera;
        if file.evidence.residual.take().is_some() {
            file.notes.push("the residual map was that of the other model: it is left out".to_owned());
        }
    }
    let export = Export { camera: &file.camera, evidence: &file.evidence, report: None };
    let written = format::write(output.format, &export)?;
    store::write(path, written.text.as_bytes())?;
    let [w, h] = file.camera.size_px;
    print(&format!(
        "{} ({}) -> {} ({}): {w} x {h} px, {}; read back, it projects {}\n",
        input.display(),
        file.format,
        output.path,
        output.format.name,
        file.camera.model,
        within_px(written.self_check_px)
    ))?;
    for note in file.notes.iter().chain(&written.notes) {
        say(&format!("note: {note}"));
    }
    Ok(ExitCode::SUCCESS)
}
