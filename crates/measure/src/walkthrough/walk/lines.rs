//! What a walk tells: a line a frame, and a summary a mode.

use super::super::crowd::CrowdSeen;
use super::{Missed, Setting, Times, WalkMode};
use enfilade::runtime::FrameStats;
use serde::Serialize;

/// One frame in one mode.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FrameLine {
    /// Its number in the path, from 0.
    pub frame: usize,
    /// The mode's name.
    pub mode: &'static str,
    /// The limit below which objects are left out; absent without a limit.
    #[serde(skip_serializing_if = "is_none")]
    pub min_pixels: u32,
    /// [`FrameStats::cells`].
    pub cells: u64,
    /// [`FrameStats::portals`].
    pub portals: u64,
    /// [`FrameStats::objects`].
    pub objects: u64,
    /// [`FrameStats::triangles`].
    pub triangles: u64,
    /// [`FrameStats::small`]; absent without a limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub small: Option<u64>,
    /// Occlusion queries.
    pub queries: u64,
    /// Microseconds of one cull after the previous frame; in modes with queries, including the triangles that the oracle draws.
    pub us: f64,
    /// The same plus drawing all remaining objects into the software oracle, at the pictures' size, microseconds; absent if no
    /// mode of the walk has queries.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_us: Option<f64>,
    /// The method that `auto` chose; absent in other modes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<&'static str>,
    /// In the mode `exact`: visible triangles; absent in others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_triangles: Option<u64>,
    /// In the mode `exact`: undecided triangles; absent in others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided_triangles: Option<u64>,
    /// Objects with an exact witness that the set leaves out. Present only if the walk has the mode `exact`, in other modes
    /// without queries and without a limit: those leave out objects without pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_objects: Option<u64>,
    /// Pixels with an object that the set leaves out; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// Such pixels seen only through a crack between triangles ([`crate::walkthrough::missed`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crack_pixels: Option<u64>,
    /// Such pixels seen only through a hole that counts as opaque; absent if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_pixels: Option<u64>,
    /// Missed pixels of the object with most of them; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_missed_pixels: Option<u64>,
    /// Movers; absent without them, and in the mode `exact`.
    #[serde(flatten)]
    pub movers: Option<CrowdSeen>,
}

/// Whether there is no limit.
fn is_none(min_pixels: &u32) -> bool {
    *min_pixels == 0
}

/// Results of all frames in one mode.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Summary {
    /// Number of frames.
    pub frames: usize,
    /// The mode's name.
    pub mode: &'static str,
    /// The limit below which objects are left out; absent without a limit.
    #[serde(skip_serializing_if = "is_none")]
    pub min_pixels: u32,
    /// Mean of kept triangles.
    pub triangles_mean: f64,
    /// Mean of kept objects.
    pub objects_mean: f64,
    /// Mean of [`FrameLine::small`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub small_mean: Option<f64>,
    /// Median time, microseconds.
    pub us_median: f64,
    /// 99th percentile of times, microseconds.
    pub us_p99: f64,
    /// Median of [`FrameLine::frame_us`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_us_median: Option<f64>,
    /// Mean number of occlusion queries.
    pub queries_mean: f64,
    /// Sum of [`FrameLine::lost_objects`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_objects: Option<u64>,
    /// Sum over frames; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// Sum over frames; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crack_pixels: Option<u64>,
    /// Sum of [`FrameLine::closed_pixels`]; absent if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_pixels: Option<u64>,
    /// Missed pixels of the worst frame; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_missed_pixels: Option<u64>,
    /// Greatest [`FrameLine::most_missed_pixels`]. Conservative rows keep it at 0, or below the limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_missed_pixels: Option<u64>,
    /// Mean triangles of the objects that show in the pictures: the set of a perfect culler. Absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact_triangles_mean: Option<f64>,
    /// Mean of [`FrameLine::visible_triangles`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_triangles_mean: Option<f64>,
    /// Mean of [`FrameLine::undecided_triangles`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided_triangles_mean: Option<f64>,
    /// Frames that met a limit of work and therefore kept more.
    pub capped_frames: u64,
    /// Sums of [`FrameLine::movers`].
    #[serde(flatten)]
    pub movers: Option<CrowdSeen>,
}

pub(super) fn frame_line(
    frame: usize,
    setting: Setting,
    stats: &FrameStats,
    times: Times,
    missed: Option<&Missed>,
) -> FrameLine {
    let tenths = |us: f64| (us * 10.0).round() / 10.0;
    FrameLine {
        frame,
        mode: setting.mode.name(),
        min_pixels: setting.min_pixels,
        cells: stats.cells,
        portals: stats.portals,
        objects: stats.objects,
        triangles: stats.triangles,
        small: (setting.min_pixels > 0).then_some(stats.small),
        queries: stats.queries,
        us: tenths(times.cull),
        frame_us: times.frame.map(tenths),
        method: None,
        visible_triangles: None,
        undecided_triangles: None,
        lost_objects: None,
        missed_pixels: missed.map(|m| m.pixels.len() as u64),
        crack_pixels: missed.map(|m| m.cracks),
        closed_pixels: missed.map(|m| m.closed).filter(|&closed| closed > 0),
        most_missed_pixels: missed.map(|m| m.most_of_one),
        movers: None,
    }
}

pub(super) fn caption(line: &FrameLine, all_triangles: u64) -> String {
    let FrameLine { frame, mode, cells, portals, objects, triangles, us, .. } = line;
    format!(
        "frame {frame} {mode}: {cells} cells {portals} portals {objects} objects {triangles}/{all_triangles} triangles {us:.0} us"
    )
}

pub(super) fn summary(
    setting: Setting,
    lines: &[FrameLine],
    exact_triangles_mean: Option<f64>,
    capped_frames: u64,
) -> Summary {
    let mean = |f: fn(&FrameLine) -> u64| lines.iter().map(f).sum::<u64>() as f64 / lines.len().max(1) as f64;
    let total = |f: fn(&FrameLine) -> Option<u64>| lines.iter().map(f).sum::<Option<u64>>();
    let greatest = |f: fn(&FrameLine) -> Option<u64>| lines.iter().map(f).try_fold(0, |most, of| Some(most.max(of?)));
    let is_exact = setting.mode == WalkMode::Exact;
    let judged = |f: fn(&FrameLine) -> Option<u64>| total(f).map(|sum| sum as f64 / lines.len().max(1) as f64);
    let sorted = |f: fn(&FrameLine) -> Option<f64>| {
        let mut times = lines.iter().map(f).collect::<Option<Vec<f64>>>()?;
        times.sort_by(f64::total_cmp);
        Some(times)
    };
    // The least time that this share of the frames does not exceed.
    let percentile =
        |times: &[f64], p: usize| times.get((times.len() * p).div_ceil(100).saturating_sub(1)).copied().unwrap_or(0.0);
    let times = sorted(|l| Some(l.us)).unwrap_or_default();
    Summary {
        frames: lines.len(),
        mode: setting.mode.name(),
        min_pixels: setting.min_pixels,
        triangles_mean: mean(|l| l.triangles),
        objects_mean: mean(|l| l.objects),
        small_mean: judged(|l| l.small),
        us_median: percentile(&times, 50),
        us_p99: percentile(&times, 99),
        frame_us_median: sorted(|l| l.frame_us).map(|times| percentile(&times, 50)),
        queries_mean: mean(|l| l.queries),
        lost_objects: total(|l| l.lost_objects),
        missed_pixels: total(|l| l.missed_pixels),
        crack_pixels: total(|l| l.crack_pixels),
        closed_pixels: Some(lines.iter().filter_map(|l| l.closed_pixels).sum()).filter(|&closed| closed > 0),
        worst_missed_pixels: greatest(|l| l.missed_pixels),
        most_missed_pixels: greatest(|l| l.most_missed_pixels),
        exact_triangles_mean,
        visible_triangles_mean: judged(|l| l.visible_triangles).filter(|_| is_exact),
        undecided_triangles_mean: judged(|l| l.undecided_triangles).filter(|_| is_exact),
        capped_frames,
        movers: lines.iter().map(|l| l.movers).sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::runtime::Mode;

    const BOTH: Setting = Setting { mode: WalkMode::Culled(Mode::PortalsAndPvs), min_pixels: 0 };

    #[test]
    fn a_summary_is_of_its_lines() {
        let setting = Setting { min_pixels: 4, ..BOTH };
        let lines: Vec<FrameLine> = (1..=200)
            .map(|i| {
                let stats = FrameStats { objects: i, triangles: 2 * i, small: 3, ..FrameStats::default() };
                let missed = i / 100 % 2;
                let missed = Missed { pixels: vec![0; 5 * missed as usize], cracks: 1, closed: 0, most_of_one: 3 * missed };
                frame_line(i as usize, setting, &stats, Times { cull: i as f64, frame: None }, Some(&missed))
            })
            .collect();
        let s = summary(setting, &lines, Some(3.0), 0);
        assert_eq!((s.frames, s.objects_mean, s.triangles_mean), (200, 100.5, 201.0));
        assert_eq!((s.us_median, s.us_p99, s.missed_pixels, s.crack_pixels), (100.0, 198.0, Some(500), Some(200)));
        assert_eq!((s.worst_missed_pixels, s.most_missed_pixels, s.small_mean), (Some(5), Some(3), Some(3.0)));
        let line = frame_line(0, BOTH, &FrameStats::default(), Times { cull: 1.0, frame: None }, None);
        let none = serde_json::to_string(&summary(BOTH, &[line], None, 0)).unwrap();
        assert!(["missed_pixels", "frame_us", "small", "min_pixels"].iter().all(|absent| !none.contains(absent)), "{none}");
    }
}
