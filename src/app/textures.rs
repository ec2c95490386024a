//! Pictures on the graphics card: each is sent once.

use std::{
    collections::BTreeMap,
    hash::{Hash as _, Hasher as _},
};

use egui::{ColorImage, TextureHandle, TextureOptions};

use super::state::Data;
use crate::{
    calib::observation::FrameId,
    job::{Key, raster::Raster},
};

/// A picture of which a part of the pixels may do.
struct Large {
    key: Key,
    /// Pixels of the picture for one of the texture.
    step: usize,
    texture: TextureHandle,
}

/// What was sent.
#[derive(Default)]
pub struct Textures {
    /// Small copies, and what each was made from.
    thumbnails: BTreeMap<FrameId, (Option<Key>, TextureHandle)>,
    /// The selected picture, as it is and straightened: smooth for panels, with hard pixels for the loupe.
    large: BTreeMap<&'static str, Large>,
    /// Maps by name and what they were made from.
    maps: BTreeMap<&'static str, (u64, TextureHandle)>,
}

impl Textures {
    /// The thumbnail of a picture, where it has one.
    pub fn thumbnail(&mut self, ctx: &egui::Context, id: FrameId, data: &Data) -> Option<&TextureHandle> {
        let made_from = data.made_from.get(&id).copied();
        if self.thumbnails.get(&id).is_none_or(|(key, _)| *key != made_from) {
            let image = image(data.thumbnails.get(&id)?.as_deref()?, 1);
            let texture = ctx.load_texture(format!("thumbnail {}", id.0), image, TextureOptions::LINEAR);
            self.thumbnails.insert(id, (made_from, texture));
        }
        self.thumbnails.get(&id).map(|(_, texture)| texture)
    }

    /// A large picture under a name, as fine as it is looked at: `zoom` is pixels of the screen for one of the picture. Sent again
    /// where its key has changed, or where someone looks closer.
    pub fn large(
        &mut self,
        ctx: &egui::Context,
        name: &'static str,
        key: Key,
        raster: &Raster,
        zoom: f64,
    ) -> TextureHandle {
        let side = ctx.input(|i| i.max_texture_side).max(1);
        let least = raster.size_px[0].max(raster.size_px[1]).div_ceil(side);
        let step = closest_step(zoom).max(least);
        if self.large.get(name).is_none_or(|large| large.key != key || large.step > step) {
            // Magnified pixels stay pixels; made smaller they are averaged.
            let options =
                TextureOptions { magnification: egui::TextureFilter::Nearest, ..TextureOptions::LINEAR };
            let options = options.with_mipmap_mode(Some(egui::TextureFilter::Linear));
            let texture = ctx.load_texture(name, image(raster, step), options);
            self.large.insert(name, Large { key, step, texture });
        }
        self.large[name].texture.clone()
    }

    /// The pixels of a part of a large picture, under a name: `part` is its first column and row, and how many of each.
    pub fn part(
        &mut self,
        ctx: &egui::Context,
        name: &'static str,
        key: Key,
        raster: &Raster,
        part: [[usize; 2]; 2],
    ) -> TextureHandle {
        let mut hash = std::hash::DefaultHasher::new();
        (key, part).hash(&mut hash);
        let made_from = hash.finish();
        if self.maps.get(name).is_none_or(|(k, _)| *k != made_from) {
            let [[x, y], [w, h]] = part;
            let row = |v: usize| ((y + v) * raster.size_px[0] + x) * raster.channels;
            let data = (0..h).flat_map(|v| raster.data[row(v)..row(v) + w * raster.channels].iter().copied());
            let cut = Raster { size_px: [w, h], channels: raster.channels, data: data.collect() };
            let texture = ctx.load_texture(name, image(&cut, 1), TextureOptions::NEAREST);
            self.maps.insert(name, (made_from, texture));
        }
        self.maps[name].1.clone()
    }

    /// A map under a name, made anew where `made_from` has changed.
    pub fn map(
        &mut self,
        ctx: &egui::Context,
        name: &'static str,
        made_from: u64,
        make: impl FnOnce() -> ColorImage,
    ) -> TextureHandle {
        if self.maps.get(name).is_none_or(|(k, _)| *k != made_from) {
            self.maps.insert(name, (made_from, ctx.load_texture(name, make(), TextureOptions::LINEAR)));
        }
        self.maps[name].1.clone()
    }
}

/// The largest power of two by which a picture can be made smaller without being seen.
fn closest_step(zoom: f64) -> usize {
    let free = (1.0 / zoom.max(1e-3)).max(1.0);
    1 << (free.log2().floor() as u32)
}

/// For the graphics card; made smaller by a whole factor, each pixel the mean of the box that it covers.
fn image(raster: &Raster, step: usize) -> ColorImage {
    let [w, h] = raster.size_px;
    if step > 1 {
        let size_px = [w / step, h / step].map(|n| n.max(1));
        let [across, down] = [step.min(w), step.min(h)];
        let n = raster.channels;
        let mut data = Vec::with_capacity(size_px[0] * size_px[1] * n);
        for y in 0..size_px[1] {
            for x in 0..size_px[0] {
                let mut sum = [0u32; 3];
                for v in 0..down {
                    let from = ((y * step + v) * w + x * step) * n;
                    for pixel in raster.data[from..from + across * n].chunks_exact(n) {
                        for (sum, value) in sum.iter_mut().zip(pixel) {
                            *sum += u32::from(*value);
                        }
                    }
                }
                let count = (across * down) as u32;
                data.extend(sum[..n].iter().map(|sum| ((sum + count / 2) / count) as u8));
            }
        }
        return image(&Raster { size_px, channels: n, data }, 1);
    }
    if raster.channels == 1 {
        ColorImage::from_gray([w, h], &raster.data)
    } else {
        ColorImage::from_rgb([w, h], &raster.data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_picture_holds_means() {
        let raster = Raster { size_px: [5, 4], channels: 1, data: (0..20).map(|i| i * 10).collect() };
        let small = image(&raster, 2);
        assert_eq!(small.size, [2, 2]);
        let values: Vec<u8> = small.pixels.iter().map(|c| c.r()).collect();
        assert_eq!(values, [30, 50, 130, 150]);
        assert_eq!([2.0, 1.0, 0.6, 0.5, 0.26, 0.1].map(closest_step), [1, 1, 1, 2, 2, 8]);
    }
}
