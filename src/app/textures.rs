//! Pictures on the graphics card: each is sent once.

use std::collections::BTreeMap;

use egui::{ColorImage, TextureHandle, TextureOptions};

use super::state::Data;
use crate::{
    calib::observation::FrameId,
    job::{Key, raster::Raster},
};

/// What was sent.
#[derive(Default)]
pub struct Textures {
    /// Small copies, and what each was made from.
    thumbnails: BTreeMap<FrameId, (Option<Key>, TextureHandle)>,
    /// The selected picture, as it is and straightened: smooth for panels, with hard pixels for the loupe.
    large: BTreeMap<&'static str, (Key, TextureHandle)>,
    /// Maps by name and what they were made from.
    maps: BTreeMap<&'static str, (u64, TextureHandle)>,
}

impl Textures {
    /// The thumbnail of a picture, where it has one.
    pub fn thumbnail(&mut self, ctx: &egui::Context, id: FrameId, data: &Data) -> Option<&TextureHandle> {
        let made_from = data.made_from.get(&id).copied();
        if self.thumbnails.get(&id).is_none_or(|(key, _)| *key != made_from) {
            let image = image(data.thumbnails.get(&id)?.as_deref()?, usize::MAX);
            let texture = ctx.load_texture(format!("thumbnail {}", id.0), image, TextureOptions::LINEAR);
            self.thumbnails.insert(id, (made_from, texture));
        }
        self.thumbnails.get(&id).map(|(_, texture)| texture)
    }

    /// A large picture under a name; sent again where its key has changed.
    pub fn large(
        &mut self,
        ctx: &egui::Context,
        name: &'static str,
        key: Key,
        raster: &Raster,
    ) -> TextureHandle {
        if self.large.get(name).is_none_or(|(k, _)| *k != key) {
            let side = ctx.input(|i| i.max_texture_side);
            // Magnified pixels stay pixels; made smaller they are averaged.
            let options =
                TextureOptions { magnification: egui::TextureFilter::Nearest, ..TextureOptions::LINEAR };
            let options = options.with_mipmap_mode(Some(egui::TextureFilter::Linear));
            let texture = ctx.load_texture(name, image(raster, side), options);
            self.large.insert(name, (key, texture));
        }
        self.large[name].1.clone()
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

/// For the graphics card; made smaller by a whole factor where a side is longer than `side`.
fn image(raster: &Raster, side: usize) -> ColorImage {
    let [w, h] = raster.size_px;
    let step = w.max(h).div_ceil(side.max(1)).max(1);
    if step > 1 {
        let size = [w / step, h / step];
        let places =
            (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (y * step * w + x * step) * raster.channels));
        let data: Vec<u8> =
            places.flat_map(|at| raster.data[at..at + raster.channels].iter().copied()).collect();
        return image(&Raster { size_px: size, channels: raster.channels, data }, usize::MAX);
    }
    if raster.channels == 1 {
        ColorImage::from_gray([w, h], &raster.data)
    } else {
        ColorImage::from_rgb([w, h], &raster.data)
    }
}
