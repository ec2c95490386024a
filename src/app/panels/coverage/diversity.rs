//! How differently the boards stood: tilt, roll, distance.

use egui::{Align2, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::NOTHING;
use crate::{
    app::{
        cx::Cx,
        plots::Axis,
        state::State,
        style::font,
        widgets::{empty, minus, named, text},
    },
    calib::{number::significant, observation::FrameId},
};

/// One property of all boards.
struct Strip {
    title: &'static str,
    words: String,
    axis: Axis,
    values: Vec<(FrameId, f64)>,
}

fn data(state: &State) -> Option<Vec<Strip>> {
    let (answer, _) = state.data.solved()?;
    let report = answer.report();
    let gather = |value: fn(&crate::calib::report::FrameReport) -> Option<f64>| -> Vec<(FrameId, f64)> {
        answer.used().filter_map(|(id, f)| Some((id, value(f)?))).collect()
    };
    let range = |values: &[(FrameId, f64)]| {
        values.iter().fold((f64::MAX, f64::MIN), |(l, h), (_, v)| (l.min(*v), h.max(*v)))
    };
    let tilts = gather(|f| f.tilt_rad.map(f64::to_degrees));
    let rolls = gather(|f| f.roll_rad.map(f64::to_degrees));
    let distances = gather(|f| f.distance);
    let strong = tilts.iter().filter(|(_, v)| *v >= 15.0).count();
    let (low, high) = range(&tilts);
    let tilt_words = format!(
        "From {low:.0}° to {high:.0}°; {strong} of {} at 15° or more. Only tilt tells focal length from distance.",
        tilts.len()
    );
    let (near, far) = range(&distances);
    let (least, most) = range(&rolls);
    let turned = if most - least > 30.0 {
        "They differ enough."
    } else {
        "Turn the board in its plane by a quarter, too."
    };
    let unit = report.settings.unit.name();
    Some(vec![
        Strip {
            title: "Tilt",
            words: tilt_words,
            axis: Axis::new(0.0, high.max(60.0), 6, "°"),
            values: tilts,
        },
        Strip {
            title: "Roll",
            words: format!("From {}° to {most:.0}°. {turned}", minus(format!("{least:.0}"))),
            axis: Axis::new(-180.0, 180.0, 8, "°"),
            values: rolls,
        },
        Strip {
            title: "Distance",
            words: format!(
                "From {} to {} {unit}, a factor of {:.1}.",
                significant(near, 3),
                significant(far, 3),
                far / near.max(1e-9)
            ),
            axis: Axis::new(0.0, far * 1.08, 6, unit),
            values: distances,
        },
    ])
}

/// Three strips.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    let t = cx.t;
    let Some(strips) = data(cx.state) else { return empty(ui, t, NOTHING) };
    let all = ui.available_rect_before_wrap();
    let high = (all.height() / strips.len() as f32).min(150.0);
    let selected = cx.state.selected();
    for (k, strip) in strips.iter().enumerate() {
        let rect = Rect::from_min_size(all.min + vec2(0.0, high * k as f32), vec2(all.width(), high - 10.0));
        let mut words = crate::app::panels::part(ui, strip.title, rect);
        words.horizontal(|ui| {
            ui.label(text(strip.title, font::semibold(font::SMALL), t.ink));
            ui.label(text(strip.words.as_str(), font::regular(font::SMALL), t.text2));
        });
        let line =
            rect.shrink2(vec2(14.0, 0.0)).with_min_y(rect.top() + 28.0).with_max_y(rect.bottom() - 22.0);
        let [low, top] = strip.axis.range;
        let x = |v: f64| line.left() + line.width() * ((v - low) / (top - low)) as f32;
        ui.painter().hline(line.x_range(), line.bottom(), Stroke::new(1.0, t.line2));
        for tick in &strip.axis.ticks {
            ui.painter().vline(x(*tick), line.bottom()..=line.bottom() + 4.0, Stroke::new(1.0, t.line2));
            let label = minus(format!("{tick}"));
            let unit = if Some(tick) == strip.axis.ticks.last() {
                format!("{label} {}", strip.axis.unit)
            } else {
                label
            };
            ui.painter().text(
                pos2(x(*tick), line.bottom() + 6.0),
                Align2::CENTER_TOP,
                unit,
                font::regular(font::CAPTION),
                t.text3,
            );
        }
        let response = ui.interact(line, ui.scope_id().with(("strip", k)), Sense::click());
        named(&response, egui::Role::Image, true, &format!("{}: {}", strip.title, strip.words));
        for (id, value) in &strip.values {
            let chosen = selected == Some(*id);
            let (color, width) = if chosen { (t.accent, 3.0) } else { (t.bar2, 1.6) };
            ui.painter().vline(x(*value), line.top()..=line.bottom() - 1.0, Stroke::new(width, color));
        }
        let nearest = |at: egui::Pos2| {
            let near = strip.values.iter().map(|(id, v)| ((x(*v) - at.x).abs(), *id));
            near.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(d, _)| *d < 8.0).map(|(_, id)| id)
        };
        if let Some(id) = response.hover_pos().and_then(nearest) {
            if response.clicked() {
                cx.select(id);
            }
            response.on_hover_text_at_pointer(cx.state.name(id));
        }
    }
}
