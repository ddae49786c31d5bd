//! Bakes that several processes share by way of a folder give one bake's bytes: with any number of workers, in any order,
//! late ones, killed ones, and files in the folder that are damaged or another's.

#[cfg(target_os = "linux")]
use crate::cli::limited;
use crate::cli::{LEVEL, command, done, folder, refused, run_words, signalled, text};
use enfilade::bake::{BakeError, BakeOptions, bake, digest, size_objects};
use enfilade::file::PvsFile;
use enfilade::job::{Digest, Folder, FolderError, Job};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::gltf;
use enfilade_scenes::{Kind, generate};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};
use testing::bakes;
use testing::random::Random;

/// Bytes of a worker's file before its first block: magic and three digests.
const HEAD: usize = 56;

/// A gallery of nine rooms as a model, and its bake by one process.
struct Gallery {
    model: PathBuf,
    scene: Scene,
    options: BakeOptions,
    whole: Vec<u8>,
}

fn gallery() -> &'static Gallery {
    static MADE: OnceLock<Gallery> = OnceLock::new();
    MADE.get_or_init(|| {
        let glb = generate(Kind::Gallery { rooms: 9 }, 1).unwrap().glb;
        let model = folder("model").join("gallery.glb");
        std::fs::write(&model, &glb).unwrap();
        let import = ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() };
        let scene = gltf::from_slice(&glb, "gallery", None, &import).unwrap();
        let mut options = BakeOptions { import, ..bakes::with_rays(200_000) };
        // As the command chooses them.
        let (scene, _) = size_objects(scene, &mut options, false, &Job::quiet()).unwrap();
        let whole = bake(&scene, options.clone(), &Job::quiet()).unwrap().file.write();
        Gallery { model, scene, options, whole }
    })
}

/// The bytes of a file without the digest of its bake, which only the program puts in.
fn content(path: &Path) -> Vec<u8> {
    PvsFile { bake: None, ..PvsFile::load(path).unwrap() }.write()
}

/// What a worker said.
type Said = Arc<Mutex<Vec<String>>>;

fn open(dir: &Path, place: [u32; 2], digest: Digest, outputs: &[PathBuf]) -> (Result<Folder, FolderError>, Said) {
    let said = Said::default();
    let to = said.clone();
    let say = Box::new(move |line: &str| to.lock().unwrap().push(line.to_owned()));
    (Folder::open(dir, place, digest, outputs, say), said)
}

/// How a worker ended.
#[derive(PartialEq, Debug)]
enum End {
    Baked,
    OthersWere,
    Disagreed(String),
}

/// A worker on one thread, in this process; it writes what it bakes to each of `outputs`.
fn work(dir: &Path, place: [u32; 2], outputs: &[PathBuf]) -> (End, Vec<String>) {
    let Gallery { scene, options, whole, .. } = gallery();
    let (opened, said) = open(dir, place, digest(scene, options), outputs);
    let folder = opened.unwrap();
    let job = Job::new(&|_, _| ()).shared_in(&folder);
    let end = match bakes::on(1, || bake(scene, options.clone(), &job)) {
        Ok(baked) => {
            assert!(baked.file.write() == *whole, "other bytes by worker {} of {}", place[0], place[1]);
            outputs.iter().for_each(|path| baked.file.save(path).unwrap());
            folder.finish().unwrap();
            End::Baked
        }
        Err(BakeError::Stopped(_)) => match folder.disagreement() {
            Some(disagreement) => End::Disagreed(disagreement.to_owned()),
            None => {
                assert!(folder.done_by().is_some(), "nobody stopped it");
                End::OthersWere
            }
        },
        Err(e) => panic!("{e}"),
    };
    let said = said.lock().unwrap().clone();
    (end, said)
}

/// Items that a worker computed: the results in its file, but for the one that names its host.
fn items(dir: &Path, worker: u32) -> usize {
    let results = results(&std::fs::read(dir.join(format!("worker-{worker}"))).unwrap());
    results.iter().filter(|((map, _), _)| *map != u32::MAX).count()
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn any_number_of_workers_gives_one_bakes_bytes() {
    for (workers, order) in [(1, vec![0]), (2, vec![1, 0]), (3, vec![2, 0, 1]), (8, vec![3, 7, 1, 0, 6, 2, 5, 4])] {
        let dir = folder(&format!("of_{workers}")).join("shared");
        let out = dir.with_file_name("out.pvs");
        let ends: Vec<End> = std::thread::scope(|scope| {
            let begin = |(i, &worker): (usize, &u32)| {
                let (dir, outputs) = (dir.clone(), [out.clone()]);
                // The last one comes when another has done some of it.
                let late = i > 0 && i + 1 == order.len();
                let first = dir.join(format!("worker-{}", order[0]));
                scope.spawn(move || {
                    while late && std::fs::metadata(&first).map_or(0, |m| m.len()) < 2_000 {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    work(&dir, [worker, workers], &outputs).0
                })
            };
            let threads: Vec<_> = order.iter().enumerate().map(begin).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        assert!(ends.contains(&End::Baked), "{ends:?}");
        assert!(content(&out) == gallery().whole);
        // Who comes when all is done has nothing to do; nor has it where the output is gone, but to write it again.
        let (end, said) = work(&dir, [workers, workers + 1], std::slice::from_ref(&out));
        assert_eq!((end, said.len(), items(&dir, workers)), (End::OthersWere, 0, 0));
        std::fs::remove_file(&out).unwrap();
        let (end, said) = work(&dir, [workers, workers + 1], std::slice::from_ref(&out));
        assert!(end == End::Baked && said.len() == 1 && said[0].contains("differs from the one here"), "{said:?}");
        assert!(items(&dir, workers) == 0 && content(&out) == gallery().whole);
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn what_others_have_is_not_worked_out_again_and_what_is_damaged_is() {
    let dir = folder("damaged").join("shared");
    let (file, all) = (dir.join("worker-0"), {
        // Of two, the other never came.
        assert_eq!(work(&dir, [0, 2], &[]), (End::Baked, Vec::new()));
        items(&dir, 0)
    });
    assert_eq!((work(&dir, [1, 2], &[]), items(&dir, 1)), ((End::Baked, Vec::new()), 0));
    std::fs::remove_file(dir.join("worker-1")).unwrap();
    // Worth as much as is sound: cut, damaged in the middle, no head, no journal; said once.
    let state = std::fs::read(&file).unwrap();
    let half = state.len() / 2;
    let mut flipped = state.clone();
    flipped[half] ^= 0x10;
    let cases: [(&[u8], &str, bool); 4] = [
        (&state[..half], "is incomplete", true),
        (&flipped, "is incomplete", true),
        (&state[..20], "", false),
        (b"Somebody's own text, of more than a head's length, and no journal.", "is not a worker's file", false),
    ];
    for (k, (bytes, complaint, helps)) in cases.into_iter().enumerate() {
        std::fs::write(&file, bytes).unwrap();
        let worker = 2 + k as u32;
        let (end, said) = work(&dir, [worker, 8], &[]);
        let expected = usize::from(!complaint.is_empty());
        assert!(end == End::Baked && said.len() == expected && said.iter().all(|line| line.contains(complaint)), "{said:?}");
        let done = items(&dir, worker);
        assert!(if helps { done > 0 && done < all } else { done == all }, "{done} of {all} in case {k}");
        assert!(std::fs::read(&file).unwrap() == bytes, "another's file is left alone");
        std::fs::remove_file(dir.join(format!("worker-{worker}"))).unwrap();
    }
    // Its own file: what is sound of it counts; one that is no journal makes room.
    std::fs::write(&file, cases[1].0).unwrap();
    let (end, said) = work(&dir, [0, 2], &[]);
    assert!(end == End::Baked && said.len() == 1 && said[0].contains("worker-0: is incomplete"), "{said:?}");
    std::fs::write(&file, cases[3].0).unwrap();
    let (end, said) = work(&dir, [0, 2], &[]);
    assert!(end == End::Baked && said.len() == 1 && said[0].contains("is not a worker's file"), "{said:?}");
    assert!(std::fs::read(file.with_extension("strange")).unwrap() == cases[3].0);
}

/// Results in a worker's file, by map and item.
type Results = Vec<((u32, u32), Vec<u8>)>;

fn results(file: &[u8]) -> Results {
    let (mut at, mut all) = (HEAD, Results::new());
    while at < file.len() {
        let length = u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let block = zstd::decode_all(&file[at + 12..at + 12 + length]).unwrap();
        all.extend(postcard::from_bytes::<Results>(&block).unwrap());
        at += 12 + length;
    }
    all
}

fn with_results(head: &[u8], results: &Results) -> Vec<u8> {
    let block = zstd::encode_all(postcard::to_stdvec(results).unwrap().as_slice(), 1).unwrap();
    let sum = xxhash_rust::xxh3::xxh3_64(&block);
    [&head[..HEAD], &(block.len() as u32).to_le_bytes(), &sum.to_le_bytes(), &block].concat()
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn who_has_other_results_is_named_and_nothing_is_written() {
    let dir = folder("other_results").join("shared");
    let out = dir.with_file_name("out.pvs");
    assert_eq!(work(&dir, [3, 4], &[]).0, End::Baked);
    let file = dir.join("worker-3");
    let state = std::fs::read(&file).unwrap();
    let sound = results(&state);
    // Neighbours' results change places: each is of the right shape.
    let mut wrong = sound.clone();
    for pair in 1..wrong.len() / 2 {
        let [a, b] = [2 * pair - 1, 2 * pair];
        if wrong[a].0.0 == wrong[b].0.0 {
            (wrong[a].0, wrong[b].0) = (wrong[b].0, wrong[a].0);
        }
    }
    std::fs::write(&file, with_results(&state, &wrong)).unwrap();
    let (end, _) = work(&dir, [1, 4], std::slice::from_ref(&out));
    let End::Disagreed(said) = end else { panic!("{end:?}") };
    let process = format!("process {}", std::process::id());
    for part in ["map ", ", item ", "worker 3 (", "worker 1 (", &process, "nothing is written"] {
        assert!(said.contains(part), "no '{part}': {said}");
    }
    assert!(!out.exists() && !dir.join("done").exists());
    std::fs::remove_file(dir.join("worker-1")).unwrap();

    // Of another shape, they count for nothing, and that is said once.
    let misshapen: Results = sound.iter().map(|(key, _)| (*key, vec![0xff; 11])).collect();
    std::fs::write(&file, with_results(&state, &misshapen)).unwrap();
    let (end, said) = work(&dir, [1, 4], std::slice::from_ref(&out));
    assert!(
        end == End::Baked && said.len() == 1 && said[0].contains("worker-3: ignored results of the wrong shape"),
        "{said:?}"
    );
    assert!(content(&out) == gallery().whole);
}

/// `bake MODEL -o OUT --with K/N:DIR` and more.
fn worker(out: &Path, dir: &Path, place: &str, more: &[&str]) -> Command {
    let mut command = command(&["bake", "--rays", "200k", "--threads", "1"].map(Path::new));
    command.arg(&gallery().model).arg("-o").arg(out).args(with(place, dir)).args(more);
    command
}

/// `--with K/N:DIR`.
fn with(place: &str, dir: &Path) -> [OsString; 2] {
    let mut value = OsString::from(format!("{place}:"));
    value.push(dir);
    ["--with".into(), value]
}

fn names(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut all: Vec<_> =
        entries.map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap())).collect();
    all.sort();
    all
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn what_belongs_elsewhere_is_refused_and_left_alone() {
    let folder = folder("refused");
    let (dir, out) = (folder.join("shared"), folder.join("out.pvs"));
    done(&worker(&out, &dir, "0/2", &[]).output().unwrap());
    assert!(content(&out) == gallery().whole, "the command bakes as the library does");
    let before = names(&dir);
    let refused_as = |command: &mut Command, parts: &[&str]| {
        refused(&command.output().unwrap(), parts);
        assert!(names(&dir) == before, "something was touched");
    };
    refused_as(&mut worker(&out, &dir, "1/2", &["--seed", "7"]), &["worker-0: belongs to other options;", "--with"]);
    let other = folder.join("other.glb");
    std::fs::write(&other, generate(Kind::Gallery { rooms: 4 }, 1).unwrap().glb).unwrap();
    let mut of_other = command(&["bake", "--rays", "200k"].map(Path::new));
    refused_as(of_other.args(with("1/2", &dir)).arg("-o").arg(&out).arg(&other), &["worker-0: belongs to another input;"]);
    for place in ["2/2", "0/0", "1", "a/b", "-1/2"] {
        assert_eq!(worker(&out, &dir, place, &[]).output().unwrap().status.code(), Some(2), "--with {place}:DIR");
    }
    assert!(names(&dir) == before);
    for value in ["0/2", "0/2:", text(&dir)] {
        assert_eq!(run_words(&["bake", text(&other), "--with", value]).status.code(), Some(2), "--with {value}");
    }
    refused(&worker(&out, &other, "0/2", &[]).output().unwrap(), &["other.glb: "]);
    #[cfg(target_os = "linux")]
    refused(&worker(&out, Path::new("/proc/enfilade"), "0/2", &[]).output().unwrap(), &["/proc/enfilade: "]);
    // Another build: all but the last digest is the same.
    let file = dir.join("worker-0");
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[HEAD - 1] ^= 1;
    std::fs::write(&file, bytes).unwrap();
    refused(&worker(&out, &dir, "1/2", &[]).output().unwrap(), &["worker-0: belongs to another build of this program;"]);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn nobody_takes_the_place_of_one_who_works() {
    let dir = folder("place").join("shared");
    let (scene, options) = (&gallery().scene, &gallery().options);
    let (first, _) = open(&dir, [1, 2], digest(scene, options), &[]);
    let first = first.unwrap();
    let (second, _) = open(&dir, [1, 2], digest(scene, options), &[]);
    let Err(error @ FolderError::InUse { .. }) = second else { panic!("taken twice") };
    let said = error.to_string();
    let process = format!(", process {}", std::process::id());
    assert!(said.contains("worker-1: worker 1 is already running, on host ") && said.ends_with(&process), "{said}");
    // Where a file can't be locked a late worker may go on beside its successor; as here, where its file is another one by
    // now.
    std::fs::remove_file(dir.join("worker-1")).unwrap();
    let (third, _) = open(&dir, [1, 2], digest(scene, options), &[]);
    let workers = [first, third.unwrap()];
    std::thread::scope(|scope| {
        for folder in &workers {
            scope.spawn(|| {
                let baked = bake(scene, options.clone(), &Job::quiet().shared_in(folder)).unwrap();
                assert!(baked.file.write() == gallery().whole);
            });
        }
    });
}

#[cfg(target_os = "linux")]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_full_disk_ends_the_keeping_and_not_the_work() {
    let folder = folder("full");
    let (dir, out) = (folder.join("shared"), folder.join("out.pvs"));
    // Room for the output and for some of the results: half of what they take.
    done(&worker(&out, &dir, "0/2", &[]).output().unwrap());
    let (results, output) = (std::fs::metadata(dir.join("worker-0")).unwrap().len(), std::fs::metadata(&out).unwrap().len());
    let room = (results / 2).max(output + 1024);
    assert!(room + 1024 < results, "an output of {output} bytes, results of {results}");
    std::fs::remove_file(&out).unwrap();
    std::fs::remove_dir_all(&dir).unwrap();
    let ended = limited(&worker(&out, &dir, "0/2", &[]), room / 1024);
    done(&ended);
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(
        said.matches("worker-0: File too large (os error 27); continues without keeping results").count(),
        1,
        "{said}"
    );
    assert!(content(&out) == gallery().whole);
}

#[test]
fn a_level_is_shared_too() {
    let folder = folder("vis");
    let (level, dir) = (folder.join("level.prt"), folder.join("shared"));
    std::fs::write(&level, LEVEL).unwrap();
    let vis = |rows: &str, more: &[OsString]| {
        let rows = folder.join(rows);
        let out = command(&[Path::new("vis"), &level, Path::new("--rows"), &rows]).args(more).output().unwrap();
        done(&out);
        (std::fs::read(&rows).unwrap(), String::from_utf8(out.stderr).unwrap())
    };
    let (whole, _) = vis("whole", &[]);
    let (shared, _) = vis("rows", &with("1/3", &dir));
    assert!(shared == whole && dir.join("done").exists());
    let (shared, said) = vis("rows", &with("0/3", &dir));
    assert!(shared == whole && said.contains("done by worker 1 ("), "{said}");
}

/// Three workers, of whom some are killed, for good or to come again; `ENFILADE_KILLS` says how many kills.
#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn killed_workers_cost_time_and_nothing_else() {
    let folder = folder("killed");
    let wanted = std::env::var("ENFILADE_KILLS").map_or(5, |n| n.parse::<u32>().expect("ENFILADE_KILLS is a number"));
    let out = folder.join("out.pvs");
    let begin = Instant::now();
    done(&worker(&out, &folder.join("first"), "0/1", &[]).output().unwrap());
    let took = begin.elapsed();
    let mut random = Random::new(1);
    let mut draw = || random.real(0.0, 1.0);
    let (mut kills, mut bakes, mut for_good) = (0, 0, 0);
    while kills < wanted || for_good == 0 {
        let (dir, out) = (folder.join(format!("shared-{bakes}")), folder.join(format!("out-{bakes}.pvs")));
        // Each worker's lives: how long until it is killed. One has no end.
        let survivor = (draw() * 3.0) as usize;
        let lives: Vec<Vec<Duration>> = (0..3)
            .map(|k| {
                let lives = (0..1 + (draw() * 2.0) as usize).map(|_| took.mul_f64(2.0 * draw())).collect::<Vec<_>>();
                if k == survivor { [lives, vec![Duration::MAX]].concat() } else { lives }
            })
            .collect();
        std::thread::scope(|scope| {
            let live = |(k, lives): (usize, &Vec<Duration>)| {
                let (lives, dir, out) = (lives.clone(), dir.clone(), out.clone());
                scope.spawn(move || {
                    let mut kills = 0;
                    for life in lives {
                        let mut command = worker(&out, &dir, &format!("{k}/3"), &[]);
                        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
                        match signalled(child, "-KILL", life) {
                            (_, None) => kills += 1,
                            (_, Some(0)) => return (kills, false),
                            (said, code) => panic!("exit {code:?}: {said}"),
                        }
                    }
                    (kills, true)
                })
            };
            let threads: Vec<_> = lives.iter().enumerate().map(live).collect();
            for thread in threads {
                let (killed, is_gone) = thread.join().unwrap();
                kills += killed;
                for_good += u32::from(is_gone);
            }
        });
        assert!(content(&out) == gallery().whole, "other bytes after {kills} kills");
        std::fs::remove_dir_all(&dir).unwrap();
        bakes += 1;
    }
    let table = format!(
        "| kills | for good | bakes | other bytes |\n| --- | --- | --- | --- |\n| {kills} | {for_good} | {bakes} | 0 |\n"
    );
    std::io::Write::write_all(&mut std::io::stderr(), table.as_bytes()).unwrap();
}
