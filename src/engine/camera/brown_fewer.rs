//! Brown–Conrady with fewer terms: `k1`; `k1 k2`; `k1 k2 k3`, radial alone; `k1 p1 p2` and `k1 k2 p1 p2`. The rest of
//! [`super::brown`]'s five is zero.

use super::{
    Spec,
    at::{At, all, all_px, one, one_px},
    opencv,
    pinhole::{self, params},
};

/// The parameters of Brown's nine that a model with `N` has, in its order.
type Places<const N: usize> = [usize; N];

#[inline(always)]
fn spread<const N: usize>(places: Places<N>, p: &[f64]) -> [f64; 9] {
    let mut all = [0.0; 9];
    for (k, place) in places.into_iter().enumerate() {
        all[place] = p[k];
    }
    all
}

fn at<const N: usize>(places: Places<N>) -> impl Fn(&[f64], [f64; 3]) -> At<N> + Copy {
    move |p, point| {
        let p = spread(places, p);
        let whole: At<9> = opencv::at(&p)(&p, point);
        At {
            px: whole.px,
            by_point: whole.by_point,
            by_params: whole.by_params.map(|by| places.map(|k| by[k])),
        }
    }
}

fn px<const N: usize>(places: Places<N>) -> impl Fn(&[f64], [f64; 3]) -> [f64; 2] + Copy {
    #[inline(always)]
    move |p, point| {
        let p = spread(places, p);
        opencv::px::<9>(&p)(&p, point)
    }
}

/// A table of one of these models.
macro_rules! table {
    ($(#[$doc:meta])* $spec:ident, $name:literal, $title:literal, $explained:literal, $places:expr, [$($term:literal)*], $examples:expr) => {
        $(#[$doc])*
        pub static $spec: Spec = Spec {
            name: $name,
            title: $title,
            explained: $explained,
            perspective: true,
            neutral: &[$({ let _ = $term; 0.0 }),*],
            params: params!($($term)*),
            project: |p, x| one(at($places), p, x),
            project_px: |p, x| one_px(px($places), p, x),
            project_batch: |p, x, out| all(at($places), p, x, out),
            project_px_batch: |p, x, out| all_px(px($places), p, x, out),
            guess_ray: pinhole::guess_ray,
            examples: $examples,
            invalid: &[&[533.0, 533.2]],
        };
    };
}

table!(
    /// `k1`.
    RADIAL1, "radial1", "Radial, 1 term", "One bend for the whole picture: tele and normal lenses",
    [0, 1, 2, 3, 4], ["k1"], &[&[533.0, 533.2, 342.3, 234.0, -0.15]]
);
table!(
    /// `k1 k2`.
    RADIAL2, "radial2", "Radial, 2 terms", "Lenses that are centred on the sensor",
    [0, 1, 2, 3, 4, 5], ["k1" "k2"], &[&[533.0, 533.2, 342.3, 234.0, -0.28, 0.08]]
);
table!(
    /// `k1 k2 k3`.
    RADIAL3, "radial3", "Radial, 3 terms", "Wider lenses that are centred on the sensor",
    [0, 1, 2, 3, 4, 5, 8], ["k1" "k2" "k3"], &[&[400.0, 400.0, 320.0, 240.0, -0.3, 0.12, -0.02]]
);
table!(
    /// `k1 p1 p2`.
    BROWN3, "brown3", "Brown, 3 terms", "One radial term, and a lens that sits askew",
    [0, 1, 2, 3, 4, 6, 7], ["k1" "p1" "p2"], &[&[600.0, 590.0, 320.0, 240.0, -0.12, -2e-3, 1e-3]]
);
table!(
    /// `k1 k2 p1 p2`.
    BROWN4, "brown4", "Brown, 4 terms", "Most ordinary lenses; OpenCV's five without k3",
    [0, 1, 2, 3, 4, 5, 6, 7], ["k1" "k2" "p1" "p2"], &[&[533.0, 533.2, 342.3, 234.0, -0.2854, 0.064, 1.1e-3, -1.3e-4]]
);
