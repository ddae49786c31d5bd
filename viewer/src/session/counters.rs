//! The counters on the screen, line by line.

use super::Session;
use crate::args::Shown;
use crate::commands::Action;
use crate::culling::{ByDevice, Decision};
use crate::draw::marks::KINDS;
use crate::mode::ViewMode;
use crate::people::People;
use crate::units::number;
use enfilade::runtime::Mode;

impl Session<'_> {
    /// Of the frame.
    pub(super) fn lines(&self) -> Vec<String> {
        let Some(last) = &self.renderer.culling.last else { return vec!["...".to_owned()] };
        let frozen = if self.motion.frozen.is_some() { ", frozen" } else { "" };
        let home = match last.home {
            Some(cell) => match &self.document.building.file.cells[cell.index()] {
                named if named.source.is_some() => format!("cell {cell} ({})", named.name),
                _ => format!("cell {cell}"),
            },
            None => "no cell needed".to_owned(),
        };
        let device = self.renderer.readback.device_ms.map_or(String::new(), |ms| format!(", GPU {ms:.2} ms"));
        let how = if self.section.is_on { format!("section: {}", last.method) } else { method(self.view.mode, last) };
        let speed = self.user.preferences.units.speed(self.motion.walker.metres_a_second());
        let mut lines = vec![format!("{how}{frozen}"), home];
        lines.extend(self.drawn(last, last.drawn(self.renderer.readback.conditional)));
        lines.extend([
            format!("culling {:.2} ms, rest of CPU {:.2} ms{device}", last.ms, self.times.rest_ms),
            format!("{:.0} frames a second", 1e3 / self.times.frame_ms.max(1e-3)),
            format!("{speed}, {:.0}° field of view", self.view.fov_y.to_degrees()),
            format!("{}: keys", self.user.keys.name_of(Action::Layer(Shown::Keys))),
        ]);
        lines.extend(self.renderer.people.as_ref().filter(|_| !self.section.is_on).map(People::line));
        lines.extend(self.say_ground());
        lines.extend(self.say_tubes());
        lines.extend(self.say_path());
        if let Some(missed) = self.renderer.readback.missed.as_ref().filter(|_| self.view.layers.alarm) {
            lines.push(self.say_missed(missed));
        }
        lines
    }

    /// Of the right half, if it is culled by another mode.
    pub(super) fn lines_beside(&self) -> Option<Vec<String>> {
        let split = self.insight.split.as_ref()?;
        let Some(last) = &split.side.culling.last else { return Some(vec![split.mode.to_string()]) };
        let mut lines = vec![method(split.mode, last)];
        lines.extend(self.drawn(last, last.drawn(split.side.readback.conditional)));
        lines.push(format!("culling {:.2} ms", last.ms));
        if let Some(kinds) = split.side.readback.marked.as_ref().map(|marked| self.renderer.kinds_of(marked)) {
            let [seen, in_vain, _] = kinds.map(|n| number(n as f64));
            lines.push(format!("{seen} {}, {in_vain} {}", KINDS[0], KINDS[1]));
        }
        Some(lines)
    }

    /// Triangles, objects, cells, portals and queries.
    fn drawn(&self, last: &Decision, drawn: ByDevice) -> [String; 3] {
        let (objects, all) = (self.document.building.scene.objects.len(), self.document.building.scene.triangles.len());
        [
            format!("{} of {} triangles", number(drawn.triangles as f64), number(all as f64)),
            format!("{} of {} objects", drawn.objects, objects),
            format!("{} cells, {} portals, {} queries", last.stats.cells, last.stats.portals, last.stats.queries),
        ]
    }
}

/// How a frame was culled.
fn method(mode: ViewMode, last: &Decision) -> String {
    match mode {
        ViewMode::Culled(Mode::Auto) => format!("auto: {}", last.method),
        mode => mode.to_string(),
    }
}
