//! How everything looks: colours, type, spacing, icons. The only place with a colour in it.
//!
//! A neutral instrument: chrome is grey and ink. Three colours belong to the marks on a picture, three to verdicts, one to
//! what is selected; shape or icon repeats every colour.

use std::sync::Arc;

use egui::{
    Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Stroke, TextStyle, Theme,
    Visuals,
};

/// Colours of one theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tokens {
    /// Behind pictures, empty cells of maps.
    pub canvas: Color32,
    /// Bars, panels, pages.
    pub bg: Color32,
    /// Tiles, popovers, drop target.
    pub raised: Color32,
    /// Buttons, chips, toggles that are on.
    pub ctl: Color32,
    /// A control under the pointer.
    pub hover: Color32,
    /// Separators and grids.
    pub line: Color32,
    /// Axes, key caps.
    pub line2: Color32,
    /// Text and overall lines.
    pub ink: Color32,
    /// Second text, icons.
    pub text2: Color32,
    /// Captions, ticks, units.
    pub text3: Color32,
    /// Text on ink or accent.
    pub on_ink: Color32,
    /// Bars.
    pub bar: Color32,
    /// Histogram, outlines of boards.
    pub bar2: Color32,
    /// What is selected.
    pub accent: Color32,
    /// Fill behind what is selected.
    pub accent_fill: Color32,
    /// Trustworthy.
    pub ok: Color32,
    /// Not certain.
    pub warn: Color32,
    /// Not trustworthy.
    pub bad: Color32,
    /// Ends and middle of the map for signed values.
    pub signed: [Color32; 3],
}

/// Detected corners.
pub const DETECTED: Color32 = Color32::from_rgb(0xB2, 0xF5, 0x6A);
/// Projected corners.
pub const PROJECTED: Color32 = Color32::from_rgb(0x4A, 0x95, 0xF8);
/// Residuals.
pub const RESIDUAL: Color32 = Color32::from_rgb(0xEC, 0x44, 0x36);
/// Under every mark on a picture.
pub const CASING: Color32 = Color32::from_rgba_premultiplied(0, 0, 0, 128);
/// Behind labels on pictures and maps.
pub const PLATE: Color32 = Color32::from_rgba_premultiplied(7, 7, 8, 184);
/// Text on a plate.
pub const ON_PLATE: Color32 = Color32::from_rgb(0xED, 0xEE, 0xF0);
/// Contours on maps, swipe lines.
pub const CONTOUR: Color32 = Color32::from_rgba_premultiplied(191, 191, 191, 191);

const fn rgb(hex: u32) -> Color32 {
    Color32::from_rgb((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

/// On black ink.
pub const DARK: Tokens = Tokens {
    canvas: rgb(0x0E0F11),
    bg: rgb(0x17181A),
    raised: rgb(0x1E1F22),
    ctl: rgb(0x292A2E),
    hover: rgb(0x33353A),
    line: rgb(0x2A2B2F),
    line2: rgb(0x43454B),
    ink: rgb(0xEDEEF0),
    text2: rgb(0xB1B4BA),
    text3: rgb(0x8D9199),
    on_ink: rgb(0x17181A),
    bar: rgb(0x71757E),
    bar2: rgb(0x8A8E97),
    accent: rgb(0xB3A0FF),
    accent_fill: Color32::from_rgba_premultiplied(0x19, 0x16, 0x24, 36),
    ok: rgb(0x7FE0DC),
    warn: rgb(0xF7BC4A),
    bad: rgb(0xF0608C),
    signed: [rgb(0xB28CFF), rgb(0x26272B), rgb(0xE08E2A)],
};

/// On white paper.
pub const LIGHT: Tokens = Tokens {
    canvas: rgb(0xD7D8DB),
    bg: rgb(0xF4F4F5),
    raised: rgb(0xFFFFFF),
    ctl: rgb(0xE7E8EA),
    hover: rgb(0xDCDDE0),
    line: rgb(0xDDDEE1),
    line2: rgb(0xBFC1C6),
    ink: rgb(0x1A1B1D),
    text2: rgb(0x4E5158),
    text3: rgb(0x676B73),
    on_ink: rgb(0xFFFFFF),
    bar: rgb(0x868A93),
    bar2: rgb(0x6E727B),
    accent: rgb(0x5B3FD6),
    accent_fill: Color32::from_rgba_premultiplied(0x09, 0x06, 0x15, 26),
    ok: rgb(0x12766C),
    warn: rgb(0x946612),
    bad: rgb(0x9B0645),
    signed: [rgb(0x583ABE), rgb(0xF7F7F8), rgb(0x844200)],
};

impl Tokens {
    /// Those of the theme that is on.
    pub fn of(ctx: &egui::Context) -> &'static Self {
        if ctx.theme() == Theme::Dark { &DARK } else { &LIGHT }
    }
}

/// Sizes of type, px, and their weights; nothing else is used.
pub mod font {
    use super::{FontFamily, FontId};

    /// Ticks, captions under numbers, key caps.
    pub const CAPTION: f32 = 11.0;
    /// Table numbers, text of findings, titles of tiles.
    pub const SMALL: f32 = 12.0;
    /// Everything else.
    pub const BODY: f32 = 13.0;
    /// Verdict, advice.
    pub const LEAD: f32 = 15.0;
    /// The numbers under the verdict.
    pub const NUMBER: f32 = 20.0;
    /// The empty state.
    pub const TITLE: f32 = 22.0;

    /// Regular.
    pub fn regular(size: f32) -> FontId {
        FontId::new(size, FontFamily::Proportional)
    }
    /// Medium.
    pub fn medium(size: f32) -> FontId {
        FontId::new(size, FontFamily::Name("medium".into()))
    }
    /// Semibold.
    pub fn semibold(size: f32) -> FontId {
        FontId::new(size, FontFamily::Name("semibold".into()))
    }
    /// For text that will be copied.
    pub fn mono(size: f32) -> FontId {
        FontId::new(size, FontFamily::Monospace)
    }
    /// What most of the window is written in.
    #[cfg(target_arch = "wasm32")]
    pub(crate) const COMMON: &[fn() -> FontId] = &[
        || regular(SMALL),
        || regular(BODY),
        || regular(CAPTION),
        || medium(SMALL),
        || medium(BODY),
        || medium(CAPTION),
        || semibold(SMALL),
        || semibold(BODY),
        || semibold(LEAD),
        || semibold(NUMBER),
    ];
    /// Filled icons: verdicts and findings only.
    pub fn fill(size: f32) -> FontId {
        FontId::new(size, FontFamily::Name("icons-fill".into()))
    }
}

/// Glyphs of the icon font (Phosphor).
#[expect(missing_docs, reason = "the names say it")]
pub mod icon {
    pub const FOLDER: &str = "\u{E256}";
    pub const ARROW: &str = "\u{E06C}";
    pub const CARET_DOWN: &str = "\u{E136}";
    pub const CARET_RIGHT: &str = "\u{E13A}";
    pub const BOARD: &str = "\u{E8C4}";
    pub const APERTURE: &str = "\u{E00A}";
    pub const UNDO: &str = "\u{E08A}";
    pub const REDO: &str = "\u{E08C}";
    pub const EXPORT: &str = "\u{EAF0}";
    pub const LIST: &str = "\u{E2F0}";
    pub const EYE: &str = "\u{E220}";
    pub const EYE_SLASH: &str = "\u{E224}";
    pub const CHECK: &str = "\u{E182}";
    pub const CHECK_CIRCLE: &str = "\u{E184}";
    pub const WARNING: &str = "\u{E4E0}";
    pub const OCTAGON: &str = "\u{E4E4}";
    pub const INFO: &str = "\u{E2CE}";
    pub const FUNNEL: &str = "\u{E268}";
    pub const SORT_UP: &str = "\u{E444}";
    pub const FIT: &str = "\u{E1D0}";
    pub const SHEET: &str = "\u{E464}";
    pub const IMAGES: &str = "\u{E836}";
    pub const IMAGE: &str = "\u{E2CA}";
    pub const CUBE: &str = "\u{E1DA}";
    pub const CHART: &str = "\u{E150}";
    pub const GRID: &str = "\u{EC8C}";
    pub const SPLIT: &str = "\u{E872}";
    pub const X: &str = "\u{E4F6}";
    pub const COPY: &str = "\u{E1CA}";
    pub const PRINTER: &str = "\u{E3DC}";
    pub const PLAY: &str = "\u{E3D2}";
    pub const SAVE: &str = "\u{E248}";
}

/// Loads fonts and both themes.
pub fn install(ctx: &egui::Context) {
    ctx.set_fonts(fonts());
    for (theme, tokens) in [(Theme::Dark, &DARK), (Theme::Light, &LIGHT)] {
        ctx.set_visuals_of(theme, visuals(theme, tokens));
    }
    ctx.all_styles_mut(|style| {
        style.text_styles = [
            (TextStyle::Small, font::regular(font::CAPTION)),
            (TextStyle::Body, font::regular(font::BODY)),
            (TextStyle::Button, font::medium(font::BODY)),
            (TextStyle::Heading, font::semibold(font::LEAD)),
            (TextStyle::Monospace, font::mono(font::SMALL)),
        ]
        .into();
        style.spacing.item_spacing = egui::vec2(6.0, 4.0);
        style.spacing.button_padding = egui::vec2(8.0, 3.0);
        style.spacing.interact_size = egui::vec2(24.0, 24.0);
        style.spacing.icon_width = 14.0;
        style.spacing.menu_margin = Margin::same(8);
        style.spacing.window_margin = Margin::same(14);
        style.spacing.scroll = egui::style::ScrollStyle::thin();
        // Layout and numbers never move by themselves, and pictures of the window must come out the same every time.
        style.animation_time = 0.0;
        style.interaction.tooltip_delay = 0.3;
        style.interaction.selectable_labels = false;
    });
}

fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::empty();
    let mut add = |name: &str, bytes: &'static [u8]| {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
    };
    add("plex", include_bytes!("../../assets/fonts/IBMPlexSans-Regular.ttf"));
    add("plex-medium", include_bytes!("../../assets/fonts/IBMPlexSans-Medium.ttf"));
    add("plex-semibold", include_bytes!("../../assets/fonts/IBMPlexSans-SemiBold.ttf"));
    add("plex-mono", include_bytes!("../../assets/fonts/IBMPlexMono-Regular.ttf"));
    add("icons", include_bytes!("../../assets/fonts/Phosphor-subset.ttf"));
    add("icons-fill", include_bytes!("../../assets/fonts/Phosphor-Fill-subset.ttf"));
    let mut family = |family: FontFamily, first: &[&str]| {
        fonts.families.insert(family, first.iter().map(|n| (*n).to_owned()).collect());
    };
    family(FontFamily::Proportional, &["plex", "icons"]);
    // These three have Latin alone: names in other letters are shown in the regular weight.
    family(FontFamily::Monospace, &["plex-mono", "plex", "icons"]);
    family(FontFamily::Name("medium".into()), &["plex-medium", "plex", "icons"]);
    family(FontFamily::Name("semibold".into()), &["plex-semibold", "plex", "icons"]);
    family(FontFamily::Name("icons-fill".into()), &["icons-fill", "icons"]);
    fonts
}

fn visuals(theme: Theme, t: &Tokens) -> Visuals {
    let mut v = theme.default_visuals();
    v.override_text_color = None;
    v.panel_fill = t.bg;
    v.window_fill = t.raised;
    v.window_stroke = Stroke::new(1.0, t.line2);
    v.window_shadow = egui::Shadow::NONE;
    v.popup_shadow = egui::Shadow::NONE;
    v.window_corner_radius = CornerRadius::same(6);
    v.menu_corner_radius = CornerRadius::same(6);
    v.extreme_bg_color = t.canvas;
    v.text_edit_bg_color = Some(t.ctl);
    v.faint_bg_color = t.raised;
    v.selection.bg_fill = t.accent_fill;
    v.selection.stroke = Stroke::new(1.0, t.accent);
    v.hyperlink_color = t.accent;
    v.warn_fg_color = t.warn;
    v.error_fg_color = t.bad;
    v.weak_text_color = Some(t.text3);
    v.striped = false;
    let widget = |w: &mut egui::style::WidgetVisuals, fill: Color32, text: Color32| {
        // Boxes to tick have no letters that would show where they are.
        w.bg_fill = fill.lerp_to_gamma(text, 0.22);
        w.weak_bg_fill = fill;
        w.bg_stroke = Stroke::NONE;
        w.fg_stroke = Stroke::new(1.0, text);
        w.corner_radius = CornerRadius::same(5);
        w.expansion = 0.0;
    };
    widget(&mut v.widgets.noninteractive, t.bg, t.ink);
    v.widgets.noninteractive.bg_stroke = Stroke::new(1.0, t.line);
    widget(&mut v.widgets.inactive, t.ctl, t.ink);
    widget(&mut v.widgets.hovered, t.hover, t.ink);
    widget(&mut v.widgets.active, t.line2, t.ink);
    widget(&mut v.widgets.open, t.hover, t.ink);
    v
}

/// A colour of a scale from `colorous`, for 0..=1.
pub fn from_map(map: colorous::Gradient, share: f64) -> Color32 {
    let c = map.eval_continuous(share.clamp(0.0, 1.0));
    Color32::from_rgb(c.r, c.g, c.b)
}

/// A colour for a signed value, −1..=1.
pub fn signed(t: &Tokens, share: f64) -> Color32 {
    let [low, middle, high] = t.signed;
    let end = if share < 0.0 { low } else { high };
    middle.lerp_to_gamma(end, share.abs().min(1.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `web/small.sh` takes out of the page what other fonts would need.
    #[test]
    fn fonts_are_plain_outlines() {
        const PLAIN: [&[u8]; 11] = [
            b"OS/2", b"cmap", b"gasp", b"glyf", b"head", b"hhea", b"hmtx", b"loca", b"maxp", b"name", b"post",
        ];
        for (name, font) in fonts().font_data {
            let bytes: &[u8] = (*font.font).as_ref();
            let number = |at: usize| usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
            for at in (0..number(4)).map(|i| 12 + 16 * i) {
                let (tag, offset) = (&bytes[at..at + 4], (number(at + 8) << 16) | number(at + 10));
                assert!(PLAIN.contains(&tag), "{name}: table {}", tag.escape_ascii());
                // Size of the longest program of a glyph.
                assert!(tag != b"maxp" || number(offset + 26) == 0, "{name} has instructions");
            }
        }
    }

    /// WCAG 2 contrast.
    fn contrast(a: Color32, b: Color32) -> f64 {
        let light = |c: Color32| {
            let linear = |v: u8| {
                let v = f64::from(v) / 255.0;
                if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
            };
            0.2126 * linear(c.r()) + 0.7152 * linear(c.g()) + 0.0722 * linear(c.b()) + 0.05
        };
        let (a, b) = (light(a), light(b));
        a.max(b) / a.min(b)
    }

    #[test]
    fn text_can_be_read() {
        for t in [&DARK, &LIGHT] {
            for text in [t.ink, t.text2, t.text3] {
                assert!(contrast(text, t.bg) >= 4.5 && contrast(text, t.raised) >= 4.5, "{text:?}");
            }
            for text in [t.ok, t.warn, t.bad, t.accent] {
                assert!(contrast(text, t.bg) >= 4.5, "{text:?}");
            }
            assert!(contrast(t.bar, t.raised) >= 3.0 && contrast(t.on_ink, t.ink) >= 4.5);
        }
    }

    #[test]
    fn the_signed_map_is_symmetric() {
        assert_eq!(signed(&DARK, 0.0), DARK.signed[1]);
        assert_eq!([signed(&DARK, -2.0), signed(&DARK, 1.0)], [DARK.signed[0], DARK.signed[2]]);
    }
}
