//! What many workers would take, simulated: a trace of one worker (`bake --trace`) is replayed with any number of them, a
//! latency, losses and late starts, in the order in which workers really take items. Checked first against real runs of one
//! and of two, on the model that `ENFILADE_MODEL` names, with `ENFILADE_RAYS` rays; `ENFILADE_TRACE` names a trace to replay
//! instead, without a check; `ENFILADE_WORKERS` is the only number of workers then.

use enfilade::job::Order;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// Simulated seconds may be off from real ones by this fraction.
const OFF: f64 = 0.15;
/// Seconds until others have a result: as long as a result may wait to be written, on one machine's disk.
const HERE: f64 = 0.05;
/// Seconds until others have a result by way of a network's disk.
const FAR: f64 = 0.25;
/// Stages whose items follow the number of rays.
const BY_RAYS: [&str; 3] = ["sampling", "aimed rays", "unseen"];

/// A map: seconds before it, when nothing is shared, and those of each item.
#[derive(Clone, Default)]
struct Map {
    before: f64,
    items: Vec<f64>,
    stage: String,
}

/// The maps of a trace of one worker; the last has no items.
fn maps(path: &Path) -> Vec<Map> {
    let text = std::fs::read_to_string(path).expect("a trace");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("map,item,worker,seconds,stage"), "{}: is no trace", path.display());
    let mut maps: BTreeMap<u32, (Map, BTreeMap<usize, f64>)> = BTreeMap::new();
    for line in lines {
        let columns: Vec<&str> = line.split(',').collect();
        let seconds: f64 = columns[3].parse().expect("seconds");
        let (map, items) = maps.entry(columns[0].parse().expect("a map")).or_default();
        match columns[1].parse() {
            Ok(item) => {
                items.insert(item, seconds);
                columns[4].clone_into(&mut map.stage);
            }
            Err(_) => map.before += seconds,
        }
    }
    let whole = |(map, items): (Map, BTreeMap<usize, f64>)| {
        assert!(items.keys().copied().eq(0..items.len()), "a trace of one worker has all items");
        Map { items: items.into_values().collect(), ..map }
    };
    maps.into_values().map(whole).collect()
}

/// The same work with `times` as many rays: so many times the items of the maps that follow the rays, and the seconds
/// between them.
fn with_rays(maps: &[Map], times: usize) -> Vec<Map> {
    let more = |(i, map): (usize, &Map)| {
        let by_rays = BY_RAYS.contains(&map.stage.as_str());
        let times = if by_rays { times } else { 1 };
        // Before the first comes the split.
        let before = map.before * if i == 0 { 1.0 } else { times as f64 };
        Map { items: map.items.repeat(times), before, ..map.clone() }
    };
    maps.iter().enumerate().map(more).collect()
}

/// A moment, ordered.
#[derive(Clone, Copy, PartialEq)]
struct At(f64);

impl Eq for At {}

impl PartialOrd for At {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for At {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Workers of one thread each.
struct Workers {
    latency: f64,
    /// When each begins, and when it is lost.
    begin: Vec<f64>,
    lost: Vec<f64>,
}

impl Workers {
    fn new(count: usize, latency: f64) -> Self {
        Self { latency, begin: vec![0.0; count], lost: vec![f64::INFINITY; count] }
    }

    /// Seconds until the first of them is through.
    fn seconds(&self, maps: &[Map]) -> f64 {
        let mut now = self.begin.clone();
        maps.iter().for_each(|map| self.run(map, &mut now));
        now.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// One map; `now` is when each worker comes to it, and then when each has all its results; infinite for those who are
    /// lost.
    fn run(&self, map: &Map, now: &mut [f64]) {
        let n = map.items.len();
        let mut orders: Vec<Order> = (0..now.len()).map(|k| Order::new(n, k, now.len())).collect();
        // Items that are done, with the moment when others know of it; ascending.
        let mut known: Vec<(f64, usize)> = Vec::with_capacity(n);
        let mut read = vec![0; now.len()];
        // Which items somebody has done, how many nobody has, and from when on everybody knows of those that are.
        let (mut is_done, mut left, mut all_known) = (vec![false; n], n, 0.0);
        let mut doing: Vec<Option<usize>> = vec![None; now.len()];
        let mut events: BinaryHeap<Reverse<(At, usize)>> = BinaryHeap::new();
        for (k, now) in now.iter_mut().enumerate() {
            *now += map.before;
            events.push(Reverse((At(*now), k)));
        }
        while let Some(Reverse((At(moment), k))) = events.pop() {
            if moment >= self.lost[k] || moment.is_infinite() {
                now[k] = f64::INFINITY;
                continue;
            }
            if let Some(item) = doing[k].take() {
                known.push((moment + self.latency, item));
                if !std::mem::replace(&mut is_done[item], true) {
                    left -= 1;
                    all_known = moment + self.latency;
                }
            }
            now[k] = moment;
            loop {
                while let Some(&(_, item)) = known.get(read[k]).filter(|(from, _)| *from <= now[k]) {
                    orders[k].close(item);
                    read[k] += 1;
                }
                let Some((item, _)) = orders[k].next_item() else { break };
                let end = now[k] + map.items[item];
                if left > 0 {
                    doing[k] = Some(item);
                    events.push(Reverse((At(end), k)));
                    break;
                }
                // Once all is done by somebody, what a worker does until it knows of that is of use to nobody else.
                now[k] = end;
                if end >= all_known {
                    break;
                }
            }
            if now[k] >= self.lost[k] {
                now[k] = f64::INFINITY;
            }
        }
    }
}

/// Known answers: no trace needed.
fn check_simulator() {
    let map = |before: f64, items: &[f64]| Map { before, items: items.to_vec(), stage: String::new() };
    let work = [map(1.0, &[2.0; 8]), map(3.0, &[])];
    let is = |workers: &Workers, seconds: f64| {
        let found = workers.seconds(&work);
        assert!((found - seconds).abs() < 1e-9, "{found} s in place of {seconds}");
    };
    is(&Workers::new(1, 0.0), 20.0);
    is(&Workers::new(2, 0.0), 12.0);
    is(&Workers::new(8, 0.0), 6.0);
    // Results of the last items come too late: whoever is through takes those that it doesn't know of.
    is(&Workers::new(2, 0.5), 14.0);
    // Of two, one never comes, or is lost at once; or comes when half is done: the first item that it does is the other's
    // last.
    let lost = |worker: usize, moment: f64| {
        let mut workers = Workers::new(2, 0.0);
        workers.lost[worker] = moment;
        workers
    };
    is(&lost(1, 0.0), 20.0);
    is(&lost(0, 5.1), 16.0);
    let mut late = Workers::new(2, 0.0);
    late.begin[1] = 8.0;
    is(&late, 16.0);
}

/// Runs `workers` processes of one thread on a model; returns the seconds that it took, and those of the import.
fn real(model: &Path, rays: &str, workers: usize, folder: &Path) -> (f64, f64) {
    let _ = std::fs::remove_dir_all(folder);
    let out = folder.with_extension("pvs");
    let _ = std::fs::remove_file(&out);
    std::fs::create_dir_all(folder).expect("room");
    let begin = Instant::now();
    let spawn = |k: usize| {
        let trace = folder.with_extension(format!("{k}.csv"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade"));
        command
            .arg("bake")
            .arg(model)
            .args(["--rays", rays, "--threads", "1", "--json", "--worker"])
            .arg(format!("{k}/{workers}"));
        command.arg("--with").arg(folder).arg("-o").arg(&out).arg("--trace").arg(trace);
        command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program")
    };
    let children: Vec<_> = (0..workers).map(spawn).collect();
    let mut import = 0.0;
    for child in children {
        let ended = child.wait_with_output().expect("an end");
        assert!(ended.status.success(), "a worker failed");
        if let Ok(report) = serde_json::from_slice::<serde_json::Value>(&ended.stdout) {
            import = report["seconds"]["import"].as_f64().expect("seconds of the import");
        }
    }
    (begin.elapsed().as_secs_f64(), import)
}

fn table(maps: &[Map], what: &str) {
    let alone = Workers::new(1, 0.0).seconds(maps);
    let serial: f64 = maps.iter().map(|map| map.before).sum();
    let items: usize = maps.iter().map(|map| map.items.len()).sum();
    println!("{what}: {} maps of {items} items, {alone:.0} s alone, {serial:.1} s between maps", maps.len() - 1);
    println!("| workers | latency, s | lost | late | s | times |\n| --- | --- | --- | --- | --- | --- |");
    let only: Option<usize> =
        std::env::var("ENFILADE_WORKERS").ok().map(|n| n.parse().expect("ENFILADE_WORKERS is a number"));
    for count in [2, 10, 100, 1000].into_iter().filter(|&count| only.is_none_or(|n| n == count)) {
        for latency in [HERE, FAR] {
            // A tenth of two is none, and a thousand take a minute.
            let tenth = if count == 1000 { 0 } else { count / 10 };
            let cases: &[(usize, usize)] = if tenth == 0 { &[(0, 0)] } else { &[(0, 0), (tenth, 0), (0, tenth)] };
            for &(lost, late) in cases {
                let mut workers = Workers::new(count, latency);
                let first = workers.seconds(maps);
                // Spread over the numbers, and over the first half of the time.
                let some = |n: usize| (0..n).map(move |i| (10 * i + 5, 0.5 * first * (i + 1) as f64 / n as f64));
                some(lost).for_each(|(k, moment)| workers.lost[k] = moment);
                some(late).for_each(|(k, moment)| workers.begin[k] = moment);
                let seconds = if lost + late > 0 { workers.seconds(maps) } else { first };
                println!("| {count} | {latency} | {lost} | {late} | {seconds:.1} | {:.1} |", alone / seconds);
            }
        }
    }
}

fn main() {
    check_simulator();
    let times = std::env::var("ENFILADE_TIMES").map_or(50, |n| n.parse().expect("ENFILADE_TIMES is a number"));
    let trace = std::env::var_os("ENFILADE_TRACE").map(PathBuf::from).unwrap_or_else(|| {
        let of_project = || Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("data/buildings/office.glb");
        let model = std::env::var_os("ENFILADE_MODEL").map_or_else(of_project, PathBuf::from);
        let rays = std::env::var("ENFILADE_RAYS").unwrap_or_else(|_| "20M".into());
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("workers");
        let (two, _) = real(&model, &rays, 2, &folder);
        let (one, import) = real(&model, &rays, 1, &folder);
        let trace = folder.with_extension("0.csv");
        let maps = maps(&trace);
        for (count, real) in [(1, one), (2, two)] {
            let seconds = import + Workers::new(count, HERE).seconds(&maps);
            println!(
                "{count} of one thread: {real:.1} s real, {seconds:.1} s simulated ({:+.1} %)",
                100.0 * (seconds / real - 1.0)
            );
            assert!((seconds / real - 1.0).abs() <= OFF, "the simulator is wrong");
        }
        println!("two are {:.2} times as fast as one", one / two);
        trace
    });
    let maps = maps(&trace);
    table(&maps, "as traced");
    table(&with_rays(&maps, times), &format!("{times} times the rays"));
}
