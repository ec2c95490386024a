//! Values between pixels: the photograph at the positions of a map.

use std::ops::Range;

use super::{
    Interpolation, Map,
    map::{FRACTION_BITS, INVALID, ONE, Row},
};
use crate::{
    Error, Result,
    image::{Photo, Sample, Samples},
    wide,
};

pub(crate) mod bilinear;
mod lanczos;
#[cfg(test)]
mod tests;

/// A photograph as the kernels see it.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a, T> {
    samples: &'a [T],
    width: usize,
    height: usize,
}

impl Map {
    /// Undistorts a photograph; pixels that are not valid are black, and transparent where there is an alpha channel.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the photograph's size is not the camera's, or its samples do not fill it.
    pub fn remap(&self, photo: &Photo, interpolation: Interpolation) -> Result<Photo> {
        self.remap_rows(photo, interpolation, 0..self.size()[1])
    }

    /// The same for some rows of the output only, so that bands can be made side by side.
    ///
    /// # Errors
    /// As [`Map::remap`], and where there are no such rows.
    pub fn remap_rows(
        &self,
        photo: &Photo,
        interpolation: Interpolation,
        rows: Range<usize>,
    ) -> Result<Photo> {
        let [w, h] = self.source_size();
        if [photo.width, photo.height] != [w, h] {
            return Err(Error::Invalid(format!(
                "the picture has {} x {} px, the camera is for {w} x {h}: take the camera of this picture, or convert it with \
                 --scale or --crop",
                photo.width, photo.height
            )));
        }
        let [width, height] = self.size();
        if rows.start > rows.end || rows.end > height {
            return Err(Error::Invalid(format!(
                "rows {rows:?} of a picture of {height} rows: give rows inside"
            )));
        }
        let samples = match &photo.samples {
            Samples::U8(s) => {
                Samples::U8(self.by_channels(s, photo.channels, interpolation, rows.clone())?)
            }
            Samples::U16(s) => {
                Samples::U16(self.by_channels(s, photo.channels, interpolation, rows.clone())?)
            }
        };
        Ok(Photo { width, height: rows.len(), channels: photo.channels, samples })
    }

    fn by_channels<T: bilinear::Blend>(
        &self,
        samples: &[T],
        channels: usize,
        interpolation: Interpolation,
        rows: Range<usize>,
    ) -> Result<Vec<T>> {
        // A page does not load a loop for each of the rare kinds.
        let rare = channels == 2 || (cfg!(target_arch = "wasm32") && (size_of::<T>() > 1 || channels == 4));
        match channels {
            1 => self.run::<T, 1>(samples, interpolation, rows),
            2..=4 if rare => self.one_by_one(samples, channels, interpolation, &rows),
            3 => self.run::<T, 3>(samples, interpolation, rows),
            4 => self.run::<T, 4>(samples, interpolation, rows),
            n => Err(Error::Invalid(format!("a photograph of {n} channels: 1 to 4 are possible"))),
        }
    }

    /// Channel after channel.
    fn one_by_one<T: bilinear::Blend>(
        &self,
        samples: &[T],
        channels: usize,
        interpolation: Interpolation,
        rows: &Range<usize>,
    ) -> Result<Vec<T>> {
        let mut out = vec![T::default(); self.size()[0] * rows.len() * channels];
        for k in 0..channels {
            let plane: Vec<T> = samples.iter().skip(k).step_by(channels).copied().collect();
            let done = self.run::<T, 1>(&plane, interpolation, rows.clone())?;
            out.iter_mut().skip(k).step_by(channels).zip(done).for_each(|(out, v)| *out = v);
        }
        Ok(out)
    }

    fn run<T: bilinear::Blend, const C: usize>(
        &self,
        samples: &[T],
        interpolation: Interpolation,
        rows: Range<usize>,
    ) -> Result<Vec<T>> {
        let [width, height] = self.source_size();
        if samples.len() != width * height * C {
            return Err(Error::Invalid(format!(
                "{} samples do not fill {width} x {height} px of {C} channels",
                samples.len()
            )));
        }
        let source = Source { samples, width, height };
        let [w, _] = self.size();
        let mut out = vec![T::default(); w * rows.len() * C];
        let mut row = Row::default();
        let kernel = (interpolation == Interpolation::Lanczos).then(lanczos::Kernel::new);
        for (v, out) in rows.zip(out.chunks_exact_mut(w * C)) {
            wide::run(Line::<T, C> {
                map: self,
                v,
                source: &source,
                kernel: kernel.as_ref(),
                row: &mut row,
                out,
            });
        }
        Ok(out)
    }
}

/// One row of the output, and what it is made from.
struct Line<'a, T, const C: usize> {
    map: &'a Map,
    /// Number of the row.
    v: usize,
    source: &'a Source<'a, T>,
    /// Lanczos' weights; none for bilinear interpolation.
    kernel: Option<&'a lanczos::Kernel>,
    row: &'a mut Row,
    out: &'a mut [T],
}

impl<T: bilinear::Blend, const C: usize> wide::Kernel for Line<'_, T, C> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.map.row(self.v, self.row);
        match self.kernel {
            None => bilinear::row::<T, C>(self.source, self.row, self.out),
            Some(kernel) => lanczos::row::<T, C>(self.source, self.row, kernel, self.out),
        }
    }
}

/// Whole and fractional part of a fixed-point coordinate whose whole part and the next must lie within `0..n`; `n ≥ 2`.
fn split(position: i32, n: usize) -> (usize, i32) {
    let whole = (position >> FRACTION_BITS).min(n as i32 - 2);
    (whole as usize, position - (whole << FRACTION_BITS))
}
