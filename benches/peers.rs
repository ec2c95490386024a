//! The Rust half of `benches/peers_speed.py`: makes the inputs and measures CPU time, one thread.
//!
//! ```text
//! cargo bench --bench peers -- prepare DIR       corners as JSON, pictures as PGM
//! cargo bench --bench peers -- calibrate DIR     one JSON object: stage → ms
//! cargo bench --bench peers -- memory DIR VIEWS  one calibration, for the memory of the process
//! cargo bench --bench peers -- undistort DIR
//! cargo bench --bench peers -- detect DIR
//! ```
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    clippy::panic,
    reason = "a benchmark reports and fails loudly"
)]

mod common;

use std::{fs, path::Path};

use common::{SIZES, VIEWS, least_ms};
use serde_json::{Map as Json, json};
use straightedge::calib::{
    calibrate::Problem,
    camera::{Camera, Model},
    detect::{self, detect},
    image::{Gray, Photo, Plane, Samples},
    undistort::{Framing, Interpolation, Map, Straightener},
};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [stage, dir, views @ ..] = &args[..] else {
        println!("nothing to do: run benches/peers_speed.py, which measures OpenCV beside this");
        return;
    };
    let dir = Path::new(dir);
    let mut out = Json::new();
    match &stage[..] {
        "prepare" => prepare(dir),
        "calibrate" => calibrate(dir, &mut out),
        "memory" => memory(dir, views, &mut out),
        "undistort" => undistort(dir, &mut out),
        "detect" => detect_all(dir, &mut out),
        other => panic!("{other}: prepare, calibrate, memory, undistort or detect"),
    }
    println!("{}", serde_json::Value::Object(out));
}

fn name([w, h]: [u32; 2]) -> String {
    format!("{w}x{h}")
}

fn prepare(dir: &Path) {
    fs::create_dir_all(dir).expect("the folder can be made");
    for views in VIEWS {
        let text = serde_json::to_string(&common::detected(views)).expect("numbers");
        fs::write(dir.join(format!("corners_{views}.json")), text).expect("written");
    }
    for size in SIZES {
        let camera = common::lens(size);
        let text = json!({ "size": size, "params": camera.params }).to_string();
        fs::write(dir.join(format!("camera_{}.json", name(size))), text).expect("written");
        for (i, picture) in common::boards(size, 4).iter().enumerate() {
            write_pgm(&dir.join(format!("board_{}_{i}.pgm", name(size))), picture);
        }
        for i in 0..2 {
            write_pgm(&dir.join(format!("clutter_{}_{i}.pgm", name(size))), &common::clutter(size, i));
        }
    }
}

fn calibrate(dir: &Path, out: &mut Json<String, serde_json::Value>) {
    for views in VIEWS {
        let text = fs::read_to_string(dir.join(format!("corners_{views}.json"))).expect("prepared");
        let problem: Problem = serde_json::from_str(&text).expect("a problem");
        let result = common::run(&problem).expect("it calibrates");
        let ms = least_ms(|| common::run(&problem));
        let steps = result.iterations.len();
        out.insert(
            views.to_string(),
            json!({ "ms": ms, "rms": result.rms_px, "fx": result.camera.params[0], "steps": steps, "used": result.views.len() }),
        );
        if MODELS_AT.contains(&views) {
            for model in [Model::Brown5, Model::Tilted] {
                out.insert(format!("{model} {views}"), of_model(&problem, model));
            }
        }
        if views == common::SPLINED.0 {
            let ms = least_ms(|| common::splined(&result, &problem));
            out.insert("splined".to_owned(), json!(ms));
        }
    }
}

/// Numbers of views at which models are compared.
const MODELS_AT: [usize; 2] = [50, 200];

/// Time of a whole calibration and of one step over all views, ms.
fn of_model(problem: &Problem, model: Model) -> serde_json::Value {
    let mut problem = problem.clone();
    problem.cameras[0].model = model;
    let result = common::run(&problem).expect("it calibrates");
    let ms = least_ms(|| common::run(&problem));
    let steps = common::Steps::new(&result, &problem.target);
    let step = least_ms(|| steps.take()) / common::Steps::COUNT as f64;
    json!({ "ms": ms, "step": step, "steps": result.iterations.len() })
}

/// Calibrates once; the process's own peak of memory says the rest.
fn memory(dir: &Path, views: &[String], out: &mut Json<String, serde_json::Value>) {
    let [views] = views else { panic!("memory DIR VIEWS") };
    let text = fs::read_to_string(dir.join(format!("corners_{views}.json"))).expect("prepared");
    let problem: Problem = serde_json::from_str(&text).expect("a problem");
    drop(text);
    let before = common::peak_mb();
    let result = common::run(&problem).expect("it calibrates");
    out.insert("used".to_owned(), json!(result.views.len()));
    out.insert("before".to_owned(), json!(before));
    out.insert("peak".to_owned(), json!(common::peak_mb()));
}

fn undistort(dir: &Path, out: &mut Json<String, serde_json::Value>) {
    for size in SIZES {
        let gray = read_pgm(&dir.join(format!("board_{}_0.pgm", name(size))));
        let camera = common::lens(size);
        let same = Camera::new(Model::Pinhole, size, camera.params[..4].to_vec()).expect("a camera");
        for channels in [1, 3] {
            let samples: Vec<u8> = gray.data().iter().flat_map(|&v| vec![v; channels]).collect();
            let [width, height] = size.map(|n| n as usize);
            let photo = Photo { width, height, channels, samples: Samples::U8(samples) };
            let mut map = Map::new(&camera, &same).expect("a map");
            if channels == 1 {
                let keep = least_ms(|| {
                    let mut map = map.clone();
                    map.keep();
                    map
                });
                out.insert(format!("{} 1 keep", name(size)), json!(keep));
            }
            let mut put = |stage: &str, ms: f64| {
                out.insert(format!("{} {channels} {stage}", name(size)), json!(ms));
            };
            let bilinear = Interpolation::Bilinear;
            put("one-shot", least_ms(|| Map::new(&camera, &same).and_then(|m| m.remap(&photo, bilinear))));
            put(
                "alpha",
                least_ms(|| {
                    Straightener::new(&camera, &Framing::flat(0.0), false)
                        .and_then(|s| s.run(&photo, bilinear))
                }),
            );
            map.keep();
            put("cached", least_ms(|| map.remap(&photo, bilinear)));
            put("lanczos", least_ms(|| map.remap(&photo, Interpolation::Lanczos)));
            if channels == 1 {
                put("map", least_ms(|| Map::new(&camera, &same).map(|m| m.mask())));
                put("view", least_ms(|| Straightener::new(&camera, &Framing::flat(0.0), false)));
            }
        }
    }
}

fn detect_all(dir: &Path, out: &mut Json<String, serde_json::Value>) {
    let mut files: Vec<_> = fs::read_dir(dir)
        .expect("prepared")
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "pgm"))
        .collect();
    files.sort();
    for file in files {
        let picture = Gray::U8(read_pgm(&file));
        let options = detect::Options::default();
        let found = detect(&picture, &options).grid.map_or(0, |g| g.corners.len());
        let ms = least_ms(|| detect(&picture, &options));
        let name = file.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        out.insert(name, json!({ "ms": ms, "corners": found }));
    }
}

fn write_pgm(path: &Path, picture: &Plane<u8>) {
    let mut bytes = format!("P5\n{} {}\n255\n", picture.width(), picture.height()).into_bytes();
    bytes.extend(picture.data());
    fs::write(path, bytes).expect("written");
}

/// Reads what [`write_pgm`] and OpenCV write.
fn read_pgm(path: &Path) -> Plane<u8> {
    let picture = image::open(path).expect("a picture").into_luma8();
    Plane::from_vec(picture.width() as usize, picture.height() as usize, picture.into_raw())
        .expect("its size")
}
