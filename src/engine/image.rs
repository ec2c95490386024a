//! Pictures in memory: planes of 8- or 16-bit samples.

/// One plane of samples, row-major, no padding. `at(x, y)` is the sample whose centre is pixel `(x, y)`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plane<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

impl<T: Copy + Default> Plane<T> {
    /// A plane of `width` × `height` samples of the default value.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, data: vec![T::default(); width * height] }
    }

    /// Wraps row-major samples; `None` where `data.len() != width · height`.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Option<Self> {
        (data.len() == width * height).then_some(Self { width, height, data })
    }

    /// A plane filled by a function of `(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                data.push(f(x, y));
            }
        }
        Self { width, height, data }
    }

    /// Width in px.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Height in px.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// All samples, row-major.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All samples, row-major, to be changed in place.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Samples, row-major, moved out.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Row `y`.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// Row `y`, to be changed in place.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.data[y * self.width..(y + 1) * self.width]
    }

    /// The sample at `(x, y)`; panics outside, as indexing does.
    pub fn at(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// A plane of the same size with every sample mapped.
    pub fn map<U: Copy + Default>(&self, f: impl FnMut(T) -> U) -> Plane<U> {
        Plane { width: self.width, height: self.height, data: self.data.iter().copied().map(f).collect() }
    }
}

/// A sample type of photographs: `u8` or `u16`.
pub trait Sample: Copy + Default + PartialOrd + Send + Sync + 'static {
    /// Largest value.
    const MAX: f32;
    /// The sample as a number, unscaled.
    fn to_f32(self) -> f32;
    /// Rounded and clamped to the range of the type.
    fn from_f32(v: f32) -> Self;
}

impl Sample for u8 {
    const MAX: f32 = 255.0;
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    fn from_f32(v: f32) -> Self {
        (v + 0.5) as Self // a float cast saturates; rounds half up on the non-negative range
    }
}

impl Sample for u16 {
    const MAX: f32 = 65535.0;
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    fn from_f32(v: f32) -> Self {
        (v + 0.5) as Self
    }
}

/// The grey values that detection works on, in the depth of the photograph.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Gray {
    /// 8-bit samples.
    U8(Plane<u8>),
    /// 16-bit samples; the used range may be any part of it.
    U16(Plane<u16>),
}

impl Gray {
    /// `[width, height]` in px.
    pub fn size(&self) -> [usize; 2] {
        match self {
            Self::U8(p) => [p.width(), p.height()],
            Self::U16(p) => [p.width(), p.height()],
        }
    }
}

/// A photograph with its colours: what undistortion reads and writes. Samples of a pixel are interleaved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    /// Width in px.
    pub width: usize,
    /// Height in px.
    pub height: usize,
    /// Samples per pixel: 1 grey, 2 grey + alpha, 3 RGB, 4 RGBA.
    pub channels: usize,
    /// Row-major, interleaved: `height · width · channels` samples.
    pub samples: Samples,
}

/// Samples of a [`Photo`] in its own depth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Samples {
    /// 8 bits.
    U8(Vec<u8>),
    /// 16 bits.
    U16(Vec<u16>),
}

impl Photo {
    /// The grey plane that detection uses: BT.601 luma weights (299, 587, 114)/1000 as OpenCV's and libjpeg's; alpha ignored.
    pub fn gray(&self) -> Gray {
        match &self.samples {
            Samples::U8(s) => Gray::U8(Plane {
                width: self.width,
                height: self.height,
                data: luma(s, self.channels, |v| v as u8),
            }),
            Samples::U16(s) => Gray::U16(Plane {
                width: self.width,
                height: self.height,
                data: luma(s, self.channels, |v| v as u16),
            }),
        }
    }

    /// [`Photo::gray`] without a copy where there is one channel.
    pub fn into_gray(self) -> Gray {
        if self.channels != 1 {
            return self.gray();
        }
        let (width, height) = (self.width, self.height);
        match self.samples {
            Samples::U8(data) => Gray::U8(Plane { width, height, data }),
            Samples::U16(data) => Gray::U16(Plane { width, height, data }),
        }
    }
}

fn luma<T: Copy + Into<u32>>(samples: &[T], channels: usize, narrow: impl Fn(u32) -> T) -> Vec<T> {
    if channels < 3 {
        return samples.iter().copied().step_by(channels.max(1)).collect();
    }
    let weigh = |p: &[T]| (p[0].into() * 299 + p[1].into() * 587 + p[2].into() * 114 + 500) / 1000;
    samples.chunks_exact(channels).map(|p| narrow(weigh(p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_round_and_saturate() {
        assert_eq!(
            [u8::from_f32(-3.0), u8::from_f32(1.5), u8::from_f32(254.4), u8::from_f32(300.0)],
            [0, 2, 254, 255]
        );
        assert_eq!([u16::from_f32(65534.6), u16::from_f32(1e9)], [65535, 65535]);
    }

    #[test]
    fn luma_of_grey_is_itself_and_ignores_alpha() {
        let photo = |channels, s: Vec<u8>| Photo { width: 1, height: 1, channels, samples: Samples::U8(s) };
        for (channels, s) in
            [(1, vec![77]), (2, vec![77, 3]), (3, vec![77, 77, 77]), (4, vec![77, 77, 77, 9])]
        {
            assert_eq!(photo(channels, s).gray(), Gray::U8(Plane { width: 1, height: 1, data: vec![77] }));
        }
        assert_eq!(photo(3, vec![255, 0, 0]).gray(), Gray::U8(Plane { width: 1, height: 1, data: vec![76] }));
    }
}
