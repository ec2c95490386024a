//! `straightedge stmap`: maps for compositing programs.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use super::{args::Framed, files, print, say, undistort::beyond_safe};
use crate::{
    calib::{
        Error, Result,
        stmap::{self, Maker, Storage, Way},
        undistort::Straightener,
    },
    job::store,
    worker::{side_by_side, threads},
};

/// Write the maps that take the lens out of a picture and put it back, for compositing programs (STMap)
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Camera file of any format; also a splined camera of mrcal
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    #[command(flatten)]
    framed: Framed,
    /// NAME.exr (32-bit floats) or NAME.png (16 bits): `_undistort` and `_distort` are added to the name
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let out = &args.out;
    let extension = out.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let storage = match extension.as_str() {
        "exr" => Storage::Exr,
        "png" => Storage::Png,
        _ => {
            return Err(Error::Invalid(format!(
                "{}: a map is written as EXR or PNG: let the name end in .exr or .png",
                out.display()
            )));
        }
    };
    let (lens, safe) = files::lens(&args.camera)?;
    let straight = Straightener::new(lens.as_ref(), &args.framed.framing(), false)?;
    for warning in &straight.warnings {
        say(&format!("warning: {}", warning.text));
    }
    beyond_safe(lens.as_ref(), safe.as_deref(), &args.framed.framing(), &straight.view)?;
    let paths = Way::ALL.map(|way| named(out, way, &extension));
    for path in &paths {
        files::may_write(path, [args.camera.as_path()])?;
    }
    let maker = Maker { lens: lens.as_ref(), straight: &straight };
    for (way, path) in Way::ALL.into_iter().zip(&paths) {
        let rows: Vec<u32> = (0..maker.size_px(way)[1]).collect();
        let rows = side_by_side(threads(None), &rows, |row| Ok(maker.row(way, *row)), &mut |_| {});
        let rows = rows.into_iter().collect::<Result<Vec<_>>>()?;
        store::write(path, &stmap::file(&rows, storage)?)?;
    }
    let [w, h] = lens.size_px();
    let [undistort, distort] = paths.map(|p| p.display().to_string());
    print(&format!(
        "{undistort}, {distort}: {}, {w} x {h} px; red and green are shares of the width from the left and of the height from the bottom\n",
        straight.view.projection
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// `lens.exr` as `lens_undistort.exr`.
fn named(out: &Path, way: Way, extension: &str) -> PathBuf {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}_{}.{extension}", way.name()))
}
