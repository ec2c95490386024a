//! Time of detection, calibration and undistortion: `cargo bench --bench speed [FILTER]`. Ratios to OpenCV come from
//! `benches/peers_speed.py`.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark fails loudly")]

mod common;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use straightedge::calib::{
    camera::{Camera, Model},
    detect::{self, detect},
    image::{Gray, Photo, Samples},
    undistort::{Framing, Interpolation, Map, Straightener},
};

/// Throughput counts corners.
fn calibration(c: &mut Criterion) {
    let mut group = c.benchmark_group("calibration");
    group.sample_size(10);
    for views in common::VIEWS {
        let problem = common::detected(views);
        let corners: usize = problem.observations.iter().map(|o| o.corners.len()).sum();
        group.throughput(Throughput::Elements(corners as u64));
        group.bench_with_input(BenchmarkId::from_parameter(views), &problem, |b, p| {
            b.iter(|| common::run(black_box(p)));
        });
    }
    group.finish();
}

/// One step of the solver, of the models with the fewest terms and the most; the splined camera.
fn models(c: &mut Criterion) {
    let mut group = c.benchmark_group("models");
    group.sample_size(10);
    let mut problem = common::detected(50);
    for model in [Model::Brown5, Model::Tilted] {
        problem.cameras[0].model = model;
        let result = common::run(&problem).expect("it calibrates");
        let steps = common::Steps::new(&result, &problem.target);
        let whole = BenchmarkId::new("whole", model);
        group.bench_function(whole, |b| b.iter(|| common::run(black_box(&problem))));
        let ten = BenchmarkId::new(format!("{} steps", common::Steps::COUNT), model);
        group.bench_function(ten, |b| b.iter(|| black_box(&steps).take()));
    }
    problem.cameras[0].model = Model::Brown5;
    let result = common::run(&problem).expect("it calibrates");
    group.bench_function("splined 30 x 20", |b| b.iter(|| common::splined(black_box(&result), &problem)));
    group.finish();
}

/// Throughput counts pixels.
fn undistortion(c: &mut Criterion) {
    let mut group = c.benchmark_group("undistortion");
    group.sample_size(20);
    let size = common::SIZES[1];
    let camera = common::lens(size);
    let target = Camera::new(Model::Pinhole, size, camera.params[..4].to_vec()).expect("a camera");
    let map = Map::new(&camera, &target).expect("a map");
    let gray = common::boards(size, 1).remove(0);
    let [width, height] = size.map(|n| n as usize);
    group.throughput(Throughput::Elements((width * height) as u64));
    group.bench_function("view", |b| {
        b.iter(|| Straightener::new(black_box(&camera), &Framing::flat(0.0), false));
    });
    group.bench_function("positions", |b| b.iter(|| black_box(&map).mask()));
    for (kind, channels) in [("grey", 1), ("RGB", 3)] {
        let samples = gray.data().iter().flat_map(|&v| vec![v; channels]).collect();
        let photo = Photo { width, height, channels, samples: Samples::U8(samples) };
        for (name, how) in [("bilinear", Interpolation::Bilinear), ("lanczos", Interpolation::Lanczos)] {
            group.bench_function(format!("{kind} {name}"), |b| b.iter(|| map.remap(black_box(&photo), how)));
        }
    }
    group.finish();
}

/// Throughput counts pixels.
fn detection(c: &mut Criterion) {
    let mut group = c.benchmark_group("detection");
    group.sample_size(10);
    let options = detect::Options::default();
    for size in common::SIZES {
        let mp = common::megapixels(size);
        group.throughput(Throughput::Elements(u64::from(size[0]) * u64::from(size[1])));
        for (kind, picture) in
            [("board", common::boards(size, 1).remove(0)), ("no board", common::clutter(size, 0))]
        {
            let picture = Gray::U8(picture);
            let id = BenchmarkId::new(kind, format!("{mp:.1} MP"));
            group.bench_with_input(id, &picture, |b, p| b.iter(|| detect(black_box(p), &options)));
        }
    }
    group.finish();
}

criterion_group!(benches, calibration, models, undistortion, detection);
criterion_main!(benches);
