//! Seeded inputs and the clock that the benchmarks and studies share.
#![allow(dead_code, reason = "each benchmark uses a part")]

use std::ops::ControlFlow;

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use straightedge::calib::{
    Result,
    calibrate::{CameraSetup, Options, Problem, calibrate},
    camera::Camera,
    image::Plane,
    observation::{Corner, FrameId, Observation},
    refine::{self, Free, Limits, Refined, State, block::Block},
    solution::Calibration,
    splined::{self, Layout},
    synth::{Degrade, Renderer, Scene, poses},
    target::Target,
};

/// Numbers of views at which calibration is measured.
pub(crate) const VIEWS: [usize; 5] = [15, 50, 200, 1000, 5000];

/// Pictures of about 0.3, 1 and 12 megapixels.
pub(crate) const SIZES: [[u32; 2]; 3] = [[640, 480], [1152, 864], [4000, 3000]];

/// Megapixels of a picture.
pub(crate) fn megapixels([w, h]: [u32; 2]) -> f64 {
    f64::from(w) * f64::from(h) * 1e-6
}

/// The seed scene's camera and board with random poses instead of its table.
pub(crate) fn random_scene(views: usize, seed: u64) -> Scene {
    let mut scene = Scene::seed();
    scene.poses = poses::random(views, &scene.camera, &scene.board, seed).expect("the seed scene has room");
    scene
}

/// A calibration of a scene from its true corners, all with `sigma_px` as their σ; noise comes with [`add_noise`].
pub(crate) fn problem(scene: &Scene, sigma_px: f64, options: Options) -> Problem {
    let corner =
        |(index, px): (usize, Option<Vector2<f64>>)| Some(Corner { index: index as u32, px: px?, sigma_px });
    let observations = (0..scene.poses.len()).map(|view| Observation {
        camera: 0,
        frame: FrameId(view as u32),
        corners: scene.corners_px(view).into_iter().enumerate().filter_map(corner).collect(),
    });
    let Camera { model, size_px, .. } = scene.camera;
    Problem {
        cameras: vec![CameraSetup { size_px, model, start: None, focal_hint_px: None }],
        target: scene.board.target(),
        observations: observations.collect(),
        options,
    }
}

/// Moves each corner by normal noise of its own σ.
pub(crate) fn add_noise(problem: &mut Problem, seed: u64) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    for corner in problem.observations.iter_mut().flat_map(|o| &mut o.corners) {
        corner.px += Vector2::new(normal(), normal()) * corner.sigma_px;
    }
}

/// What a detector hands over: random poses, noise of about 0.1 px, every corner with its own σ, which is somewhat too
/// small. Positions are rounded to `f32`, which is all that OpenCV takes.
pub(crate) fn detected(views: usize) -> Problem {
    let mut problem = problem(&random_scene(views, 1), 0.1, Options::default());
    let mut random = Pcg64::seed_from_u64(2);
    for corner in problem.observations.iter_mut().flat_map(|o| &mut o.corners) {
        corner.sigma_px = random.random_range(0.07..0.14);
    }
    add_noise(&mut problem, 3);
    for corner in problem.observations.iter_mut().flat_map(|o| &mut o.corners) {
        corner.sigma_px *= 0.8;
        corner.px = corner.px.map(|x| f64::from(x as f32));
    }
    problem
}

/// Calibrates without progress.
pub(crate) fn run(problem: &Problem) -> Result<Calibration> {
    calibrate(problem, &mut |_| ControlFlow::Continue(()))
}

/// Views, and control points, of the splined camera that is measured.
pub(crate) const SPLINED: (usize, [usize; 2]) = (50, [30, 20]);

/// Fits a splined camera to a calibration.
pub(crate) fn splined(calibration: &Calibration, problem: &Problem) -> Result<splined::Fitted> {
    let covering = Layout::covering(&calibration.camera, SPLINED.1[0])?;
    let layout = Layout { knots: SPLINED.1, ..covering };
    splined::fit(calibration, &problem.target, layout, &mut || ControlFlow::Continue(()))
}

/// Steps of the solver by themselves, from where a calibration arrived.
pub(crate) struct Steps {
    calibration: Calibration,
    blocks: Vec<Block>,
    free: Free,
}

impl Steps {
    /// Steps of one measurement.
    pub(crate) const COUNT: usize = 10;

    pub(crate) fn new(calibration: &Calibration, target: &Target) -> Self {
        let blocks = calibration.views.iter().map(|view| {
            let board = view.indices.iter().map(|i| target.point_in_board(*i).expect("on the board"));
            let board: Vec<_> = board.collect();
            let project = |p| calibration.camera.project(&view.camera_from_board.apply(p)).expect("seen");
            let px: Vec<_> = board.iter().zip(&view.residuals_px).map(|(p, r)| project(p) + r).collect();
            Block::new(&board, &px)
        });
        let blocks = blocks.collect();
        Self { blocks, free: Free::all(calibration.camera.model), calibration: calibration.clone() }
    }

    /// Takes one step and is sent back, [`Steps::COUNT`] times.
    pub(crate) fn take(&self) -> Vec<Refined> {
        let problem = refine::Problem {
            spec: self.calibration.camera.spec(),
            free: &self.free,
            blocks: &self.blocks,
            huber_px: Some(0.25),
            single_precision: false,
        };
        let mut start = State {
            params: self.calibration.camera.params.clone(),
            poses: self.calibration.views.iter().map(|v| v.camera_from_board).collect(),
        };
        start.params[0] *= 1.001;
        let limits = Limits { iterations: 1, tolerance: 0.0, damping: 1e-3, enough: None };
        let once = || refine::refine(&problem, &start, limits, &mut || ControlFlow::Continue(()));
        (0..Self::COUNT).map(|_| once().expect("the start is good")).collect()
    }
}

/// Largest memory that this process has had, MB.
pub(crate) fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or_default();
    line.trim().trim_end_matches(" kB").parse::<f64>().map_or(f64::NAN, |kb| kb / 1024.0)
}

/// The seed scene's lens before a sensor of another size.
pub(crate) fn lens(size_px: [u32; 2]) -> Camera {
    let mut camera = Scene::seed().camera;
    let scale = f64::from(size_px[0]) / f64::from(camera.size_px[0]);
    for (i, p) in camera.params[..4].iter_mut().enumerate() {
        // Centres of pixels are whole numbers, so the picture begins at −0.5.
        *p = if i < 2 { *p * scale } else { (*p + 0.5) * scale - 0.5 };
    }
    camera.size_px = size_px;
    camera
}

/// Photographs of a board with a white margin, a little blur and noise.
pub(crate) fn boards(size_px: [u32; 2], views: usize) -> Vec<Plane<u8>> {
    let mut scene = Scene { camera: lens(size_px), ..Scene::seed() };
    scene.board.margin = 1.0;
    scene.degrade = Degrade { blur: 0.7, noise: 3.0, light: 0.2, ..Degrade::default() };
    scene.poses = poses::random(views, &scene.camera, &scene.board, 4).expect("the board fits");
    let renderer = Renderer::new(&scene).expect("the scene can be drawn");
    (0..views).map(|view| renderer.render(view).expect("the view exists")).collect()
}

/// Clutter without a board: overlapping rectangles and discs of all sizes, with noise.
pub(crate) fn clutter([w, h]: [u32; 2], seed: u64) -> Plane<u8> {
    let mut random = Pcg64::seed_from_u64(seed);
    let (width, height) = (f64::from(w), f64::from(h));
    let mut light = Plane::<f32>::from_fn(w as usize, h as usize, |_, _| 128.0);
    for i in 0..400 {
        // From half the picture down to a hundredth.
        let size = 0.5 * width * 0.02f64.powf(f64::from(i) / 400.0);
        let mut draw = |a: f64, b: f64| random.random_range(a..b);
        let (x, y, angle) = (draw(0.0, width), draw(0.0, height), draw(0.0, 3.2));
        let (a, b, grey) = (size * draw(0.2, 0.5), size * draw(0.2, 0.5), draw(10.0, 245.0) as f32);
        let round = draw(0.0, 1.0) < 0.3;
        let reach = a.hypot(b);
        let span = |c: f64, n: u32| {
            (c - reach).max(0.0) as usize..((c + reach).max(0.0) as usize + 1).min(n as usize)
        };
        for v in span(y, h) {
            for u in span(x, w) {
                let (dx, dy) = (u as f64 - x, v as f64 - y);
                let p = (dx * angle.cos() + dy * angle.sin()) / a;
                let q = (dy * angle.cos() - dx * angle.sin()) / b;
                if if round { p.hypot(q) < 1.0 } else { p.abs().max(q.abs()) < 1.0 } {
                    light.row_mut(v)[u] = grey;
                }
            }
        }
    }
    light.map(|v| {
        let noise: f32 = StandardNormal.sample(&mut random);
        (v + 3.0 * noise).clamp(0.0, 255.0) as u8
    })
}

/// CPU time of this process, s.
pub(crate) fn cpu_s() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

/// Least CPU time of several calls, ms: at least three, and as many as fit into a second.
pub(crate) fn least_ms<T>(mut f: impl FnMut() -> T) -> f64 {
    let (begin, mut least, mut calls) = (cpu_s(), f64::INFINITY, 0);
    while calls < 3 || (calls < 200 && cpu_s() - begin < 1.0) {
        let start = cpu_s();
        std::hint::black_box(f());
        least = least.min(cpu_s() - start);
        calls += 1;
    }
    least * 1e3
}
