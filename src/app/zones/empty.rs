//! The empty state: one place to drop a folder on.

use egui::{Align2, Pos2, Rect, Sense, Shape, Stroke, Ui, UiBuilder, pos2, vec2};

use crate::app::{
    action::{Action, Command, demo},
    cx::Cx,
    screen::Dialog,
    style::{font, icon},
    widgets::{button, named, primary},
};

/// Draws it into everything that is left; `hovering` where files are held over the window.
pub fn show(cx: &mut Cx<'_>, ui: &mut Ui, hovering: bool) {
    let t = cx.t;
    let all = ui.available_rect_before_wrap();
    let size = vec2((all.width() - 40.0).min(920.0), (all.height() - 40.0).min(560.0));
    let rect = Rect::from_center_size(all.center(), size);
    ui.painter().rect_filled(rect, 10.0, if hovering { t.ctl } else { t.raised });
    let line = if hovering { t.ink } else { t.line2 };
    ui.painter().extend(Shape::dashed_line(
        &rounded(rect.shrink(1.0), 10.0),
        Stroke::new(1.5, line),
        8.0,
        6.0,
    ));
    let drop = ui.interact(rect, ui.scope_id().with("drop target"), Sense::hover());
    named(&drop, egui::Role::Group, true, "Drop a folder of board pictures here");

    let narrow = rect.width() < 480.0;
    let text_height = if narrow { 290.0 } else { 150.0 };
    let art = Rect::from_center_size(
        pos2(rect.center().x, rect.top() + (rect.height() - text_height) / 2.0 - 10.0),
        vec2((rect.width() - 80.0).min(500.0), (rect.height() - text_height - 90.0).clamp(40.0, 240.0)),
    );
    boards(ui, t, art);
    let y = art.bottom() + 50.0;
    let middle = rect.center().x;
    let painter = ui.painter();
    let title = "Drop a folder of board pictures";
    painter.text(pos2(middle, y), Align2::CENTER_CENTER, title, font::semibold(font::TITLE), t.ink);
    let words = "Straightedge finds the board, works out the camera and says how far to trust it.\nThe pictures stay on this computer.";
    let mut job = egui::text::LayoutJob::simple(
        words.to_owned(),
        font::regular(font::BODY),
        t.text2,
        rect.width() - 32.0,
    );
    job.halign = egui::Align::Center;
    let words = painter.layout_job(job);
    let below = y + 24.0 + words.size().y;
    painter.galley(pos2(middle, y + 24.0), words, t.text2);
    // Beside each other, or below each other where there is no room.
    let (size, layout) = if narrow {
        (vec2(180.0, 3.0 * 46.0), egui::Layout::top_down_justified(egui::Align::Center))
    } else {
        (vec2(420.0, 34.0), egui::Layout::left_to_right(egui::Align::Center))
    };
    let row = Rect::from_center_size(pos2(middle, below + 26.0 + size.y / 2.0), size);
    let mut ui = ui.new_child(UiBuilder::new().max_rect(row).layout(layout));
    let height = if narrow { 40.0 } else { 32.0 };
    ui.spacing_mut().button_padding.x = 14.0;
    ui.spacing_mut().item_spacing = vec2(10.0, 8.0);
    if primary(&mut ui, t, icon::FOLDER, "Open folder…", height).clicked() {
        cx.ask(Command::PickFolder);
    }
    if button(&mut ui, t, icon::PLAY, "Try the demo", height).clicked() {
        cx.push(Action::Open(demo()));
    }
    if button(&mut ui, t, icon::PRINTER, "Print a board…", height).clicked() {
        cx.show(|s| s.dialog = Some(Dialog::Board));
    }
}

/// A rounded rectangle as a closed path.
fn rounded(rect: Rect, radius: f32) -> Vec<Pos2> {
    let corners = [
        (rect.right_top() + vec2(-radius, radius), -90.0),
        (rect.right_bottom() + vec2(-radius, -radius), 0.0),
        (rect.left_bottom() + vec2(radius, -radius), 90.0),
        (rect.left_top() + vec2(radius, radius), 180.0),
    ];
    let mut path: Vec<Pos2> = corners
        .iter()
        .flat_map(|(center, from)| {
            (0..=6).map(move |k| {
                let angle = (from + 15.0 * k as f32).to_radians();
                *center + radius * vec2(angle.cos(), angle.sin())
            })
        })
        .collect();
    path.push(path[0]);
    path
}

/// A board as a lens bends it, and straightened.
fn boards(ui: &Ui, t: &crate::app::style::Tokens, rect: Rect) {
    let painter = ui.painter();
    let rows = 6;
    let side = (rect.height() - 24.0) / rows as f32;
    let columns = ((rect.width() / 2.0 / side).floor() as usize).clamp(3, 6);
    let middle = rect.center();
    let bend = |x: f32, y: f32| {
        let (u, v) = (x / (columns as f32 * side), y / (rows as f32 * side / 2.0));
        let r2 = u * u * 0.8 + v * v * 0.35;
        let scale = 1.0 - 0.12 * r2;
        middle + vec2(x * scale, y * scale * 1.06)
    };
    for row in 0..rows {
        for column in 0..2 * columns {
            if (row + column) % 2 == 1 {
                continue;
            }
            let left = (column as f32 - columns as f32) * side;
            let top = (row as f32 - rows as f32 / 2.0) * side;
            if column < columns {
                let n = 6;
                let edge = |from: [f32; 2], to: [f32; 2]| {
                    (0..n).map(move |k| {
                        let s = k as f32 / n as f32;
                        bend(from[0] + (to[0] - from[0]) * s, from[1] + (to[1] - from[1]) * s)
                    })
                };
                let (right, bottom) = (left + side, top + side);
                let path: Vec<Pos2> = edge([left, top], [right, top])
                    .chain(edge([right, top], [right, bottom]))
                    .chain(edge([right, bottom], [left, bottom]))
                    .chain(edge([left, bottom], [left, top]))
                    .collect();
                painter.add(Shape::convex_polygon(path, t.line2, Stroke::NONE));
            } else {
                let square = Rect::from_min_size(middle + vec2(left, top), vec2(side, side));
                painter.rect_filled(square, 0.0, t.line2);
            }
        }
    }
    let [top, bottom] = [pos2(middle.x, rect.top()), pos2(middle.x, rect.bottom())];
    painter.line_segment([top, bottom], Stroke::new(2.0, t.ink));
    painter.circle_filled(top, 3.5, t.ink);
    painter.circle_filled(bottom, 3.5, t.ink);
}
