//! What is on the screen: not saved with a session, not undone.

use std::{
    hash::{Hash, Hasher},
    path::Path,
    sync::Arc,
};

use serde::{Deserialize, Serialize};
use siphasher::sip::SipHasher13;

use super::{
    lab::Part,
    panels::{PANELS, Tile},
    state::Notice,
};
use crate::{
    calib::{
        Result,
        compare::{Side, date},
        format,
        observation::FrameId,
    },
    job::Key,
};

/// What is drawn over a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layers {
    /// Detected corners.
    pub corners: bool,
    /// Their order on the board.
    pub order: bool,
    /// Projected corners and residuals.
    pub reprojected: bool,
    /// The lens taken out.
    pub straightened: bool,
}

impl Default for Layers {
    fn default() -> Self {
        Self { corners: true, order: false, reprojected: true, straightened: false }
    }
}

/// How the picture list is sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sort {
    /// By name, as opened.
    #[default]
    Name,
    /// Largest mean error first.
    Error,
    /// Strongest tilt first.
    Tilt,
    /// Most corners first.
    Corners,
    /// What moves the camera most first.
    Influence,
}

impl Sort {
    /// All, in the order of the menu.
    pub const ALL: [Self; 5] = [Self::Name, Self::Error, Self::Influence, Self::Tilt, Self::Corners];

    /// As shown.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Name => "Name",
            Self::Error => "Error",
            Self::Tilt => "Tilt",
            Self::Corners => "Corners",
            Self::Influence => "Influence",
        }
    }
}

/// Which pictures are listed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Filter {
    /// All.
    #[default]
    All,
    /// Those that the calibration uses.
    Used,
    /// Those that it does not use.
    Aside,
    /// Those above the threshold.
    Above,
}

impl Filter {
    /// All, in the order of the menu.
    pub const ALL: [Self; 4] = [Self::All, Self::Used, Self::Aside, Self::Above];

    /// As shown.
    pub const fn name(self) -> &'static str {
        match self {
            Self::All => "All pictures",
            Self::Used => "Used",
            Self::Aside => "Set aside",
            Self::Above => "Above the threshold",
        }
    }
}

/// Where a picture is looked at from; none in [`Screen::view`] shows all of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Points of the screen for one pixel of the picture.
    pub zoom: f64,
    /// The pixel in the middle of the panel.
    pub center_px: [f64; 2],
}

/// How the 3-D view is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// About the vertical, rad.
    pub yaw: f64,
    /// Above the horizon, rad.
    pub pitch: f64,
    /// Nearer is larger; 1 shows everything.
    pub zoom: f64,
    /// Whether boards hang around one camera, or cameras around one board.
    pub board_centric: bool,
}

impl Default for Orbit {
    fn default() -> Self {
        Self { yaw: 0.6, pitch: 0.3, zoom: 1.0, board_centric: false }
    }
}

/// What part of an export is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExportPart {
    /// The camera file.
    #[default]
    Camera,
    /// Straightened pictures and figures.
    Pictures,
    /// The report.
    Report,
}

/// A dialog over the window.
#[derive(Clone, Debug, PartialEq)]
pub enum Dialog {
    /// Export, with the part and the name of the format.
    Export {
        /// What is exported.
        part: ExportPart,
        /// Index in `format::FORMATS`, or one past the end for the Python snippet.
        format: usize,
    },
    /// Keyboard shortcuts.
    Shortcuts,
    /// A board to print.
    Board,
}

/// An earlier calibration that was opened to be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Beside {
    /// Name of its file.
    pub name: String,
    /// What is in it.
    pub text: String,
    /// Tells its text from others.
    pub print: u64,
    /// The calibration.
    pub side: Side,
    /// When it was made, days since 1970, as far as the file tells.
    pub days: Option<f64>,
}

impl Beside {
    /// From the text of a camera file or report; `written` is when the file was, days since 1970, where it does not say its date itself.
    ///
    /// # Errors
    /// Those of [`format::read`].
    pub fn read(path: &Path, text: String, written: Option<f64>) -> Result<Self> {
        let name = path.display().to_string();
        let file = format::read(&text, &name)?;
        let mut print = SipHasher13::new();
        text.hash(&mut print);
        Ok(Self {
            name: path.file_name().map_or(name, |n| n.to_string_lossy().into_owned()),
            text,
            print: print.finish(),
            side: Side::from(&file),
            days: file.evidence.date.as_deref().and_then(date::days).or(written),
        })
    }
}

/// Earlier calibrations beside the one found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Earlier {
    /// Each with how warm the camera was, °C, where the user said so.
    pub list: Vec<(Arc<Beside>, Option<f64>)>,
    /// Position of the one that is compared.
    pub shown: usize,
    /// How warm the camera was in the present pictures, °C.
    pub temperature: Option<f64>,
    /// Whether all are shown as a series.
    pub over_time: bool,
}

impl Earlier {
    /// The one that is compared.
    pub fn shown(&self) -> Option<&Arc<Beside>> {
        self.list.get(self.shown).map(|(beside, _)| beside)
    }

    /// Adds one, or puts it in the place of an equal one, and shows it.
    pub fn open(&mut self, beside: Beside) {
        let known = self.list.iter().position(|(b, _)| b.name == beside.name && b.print == beside.print);
        self.shown = known.unwrap_or(self.list.len());
        if known.is_none() {
            self.list.push((Arc::new(beside), None));
        }
        self.over_time = self.list.len() > 1;
    }

    /// Takes one away.
    pub fn close(&mut self, position: usize) {
        if position < self.list.len() {
            self.list.remove(position);
        }
        self.shown = self.shown.min(self.list.len().saturating_sub(1));
        self.over_time &= !self.list.is_empty();
    }
}

/// Everything that is shown and not saved with a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Screen {
    /// The one selection, shared by all panels.
    pub selected: Option<FrameId>,
    /// Index of the selected corner on the board.
    pub corner: Option<u32>,
    /// What is in the centre.
    pub center: Tile,
    /// The page of each tile that is shown in the centre, in the order of [`super::panels::PANELS`].
    pub pages: [usize; 5],
    /// What is drawn over pictures.
    pub layers: Layers,
    /// How much longer residuals are drawn; none lets their size decide.
    pub times: Option<f64>,
    /// Whether all pictures are shown at once.
    pub sheet: bool,
    /// Where the picture is looked at from.
    pub view: Option<View>,
    /// Of the list.
    pub sort: Sort,
    /// Of the list.
    pub filter: Filter,
    /// Whether bars show the RMS; otherwise the mean.
    pub bars_rms: bool,
    /// Where the swipe is, 0..=1 of the width.
    pub swipe: f32,
    /// Which component the displacement map shows: 0 Δx, 1 Δy, 2 length.
    pub component: usize,
    /// How the 3-D view is turned.
    pub orbit: Orbit,
    /// Whether the certainty is that of points far away, instead of those as far as the boards were.
    pub far: bool,
    /// Whether *more* is unfolded in the answer.
    pub more: bool,
    /// Whether the camera models are compared in the background: once someone has looked at the lens.
    pub comparing: bool,
    /// The answer of which a twin was asked for.
    pub twin: Option<Key>,
    /// Whether the panels are where the user put them, instead of in the fixed zones.
    pub unlocked: bool,
    /// The open page of the lab.
    pub lab: Option<Part>,
    /// Earlier calibrations beside the one found.
    pub earlier: Earlier,
    /// What stands over the window.
    pub dialog: Option<Dialog>,
    /// What is to be told.
    pub notice: Option<Notice>,
}

impl Screen {
    /// Brings a page of a panel into the centre, by its name.
    pub fn go(&mut self, tile: Tile, page: &str) {
        let place = tile.index();
        self.center = tile;
        self.pages[place] = PANELS[place].pages.iter().position(|p| p.name == page).unwrap_or(0);
    }
}

impl Default for Screen {
    fn default() -> Self {
        Self {
            selected: None,
            corner: None,
            center: Tile::Picture,
            pages: [0; 5],
            layers: Layers::default(),
            times: None,
            sheet: false,
            view: None,
            sort: Sort::default(),
            filter: Filter::default(),
            bars_rms: false,
            swipe: 0.5,
            component: 2,
            orbit: Orbit::default(),
            far: false,
            more: false,
            comparing: false,
            twin: None,
            unlocked: false,
            lab: None,
            earlier: Earlier::default(),
            dialog: None,
            notice: None,
        }
    }
}
