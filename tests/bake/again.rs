//! A bake after an edit: it hides nothing that shows, whatever the last bake says, and hardly less than a bake of all.

use crate::cli::{building, done, folder, json, run_words, text};
use enfilade::bake::{BakeOptions, Baked, Last, bake};
use enfilade::file::{PairCounts, PvsFile};
use enfilade::job::Job;
use enfilade::scene::Scene;
use enfilade::{BitMatrix, CellId};
use testing::bakes::{office, on, with_rays};
use testing::edits::Model;
use testing::files::rows;
use testing::random::Random;

const RAYS: u64 = 400_000;

fn options() -> BakeOptions {
    BakeOptions { keep_bounds: true, ..with_rays(RAYS) }
}

fn fresh(scene: &Scene) -> Baked {
    bake(scene, options(), &Job::quiet()).unwrap()
}

/// The scene after the last bake, whose file is `last`.
fn again(scene: &Scene, last: &PvsFile) -> Baked {
    let last = Some(Last::read(&last.write()).unwrap());
    bake(scene, BakeOptions { last, ..options() }, &Job::quiet()).unwrap()
}

/// A small office, and a random source of edits.
fn model() -> (Model, Random) {
    (Model::of(&office(12, true).1), Random::new(7))
}

/// Every pair for which a bake of all has a witness is in the rows. How many more pairs these have, as a factor.
fn judge(baked: &Baked, all: &Baked, what: &str) -> f64 {
    assert_eq!(baked.file.cells, all.file.cells, "{what}: the same cells");
    let bounds = all.file.bounds.as_ref().unwrap();
    assert_eq!(bounds.objects_lower.first_outside(&rows(&baked.file)), None, "{what}: a pair that shows is hidden");
    rows(&baked.file).count_ones() as f64 / rows(&all.file).count_ones() as f64
}

#[test]
fn an_edit_hides_nothing_that_shows_and_little_less() {
    let (mut model, mut random) = model();
    let first = fresh(&model.scene());
    assert!(first.since.is_none());
    type Edit = fn(&mut Model, &mut Random);
    let edits: [(&str, Edit); 4] = [
        ("moved", Model::move_furniture),
        ("removed", Model::remove_furniture),
        ("a wall", Model::add_wall),
        ("a storey", |model, _| model.add_storey([3.2, 6.5], 3.3)),
    ];
    let mut last = first.file;
    for (what, edit) in edits {
        edit(&mut model, &mut random);
        let scene = model.scene();
        let (baked, all) = (again(&scene, &last), fresh(&scene));
        let since = baked.since.expect("there was a last bake");
        assert!(since.pairs.hidden > 50 && since.pairs.hidden_again * 20 > since.pairs.hidden * 19, "{what}: {since}");
        let more = judge(&baked, &all, what);
        assert!(more < 1.02, "{what}: {more} times the pairs");
        last = baked.file;
    }
}

/// Nothing but the model says what is hidden.
#[test]
fn a_forged_file_hides_nothing() {
    let (mut model, mut random) = model();
    let honest = fresh(&model.scene()).file;
    model.move_furniture(&mut random);
    let scene = model.scene();
    let all = fresh(&scene);
    let mut nothing = honest.clone();
    nothing.object_rows = Some(BitMatrix::new(honest.cells.len(), honest.objects.len()));
    let mut diagonal = BitMatrix::new(honest.cells.len(), honest.cells.len());
    (0..honest.cells.len()).for_each(|c| _ = diagonal.set(c, c));
    nothing.cell_rows = Some(diagonal);
    let mut halved = honest.clone();
    let mut rows_of = rows(&honest);
    for cell in 0..honest.cells.len() {
        rows(&honest).ones(cell).filter(|_| random.chance(0.5)).for_each(|object| rows_of.clear(cell, object));
    }
    halved.object_rows = Some(rows_of);
    // Cells that change their places, and witnesses of what nobody sees.
    let mut shuffled = honest.clone();
    shuffled.cells.reverse();
    let mut witnessed = honest.clone();
    let bounds = witnessed.bounds.as_mut().unwrap();
    bounds.witnesses.iter_mut().for_each(|witness| std::mem::swap(&mut witness.from, &mut witness.to));
    for (what, file) in [("no rows", nothing), ("half", halved), ("shuffled", shuffled)] {
        judge(&again(&scene, &counted(file)), &all, what);
    }
    judge(&again(&scene, &witnessed), &all, "witnesses");
}

/// A file of rows alone, whose counts of pairs are right.
fn counted(file: PvsFile) -> PvsFile {
    let pairs = PairCounts {
        lower: 0,
        upper: rows(&file).count_ones(),
        cell_lower: file.cells.len() as u64,
        cell_upper: pairs_of_cells(&file),
    };
    PvsFile { bounds: None, gap: None, pairs, ..file }
}

fn pairs_of_cells(file: &PvsFile) -> u64 {
    (0..file.cells.len()).map(|c| file.cells_seen(CellId(c as u32)).count() as u64).sum()
}

/// Renamed objects are new ones.
#[test]
fn names_may_change_and_threads_do_not_matter() {
    let (mut model, mut random) = model();
    let last = fresh(&model.scene()).file;
    model.move_furniture(&mut random);
    for part in model.parts.iter_mut().step_by(5) {
        part.node.insert_str(0, "renamed ");
    }
    let scene = model.scene();
    let baked = again(&scene, &last);
    let since = baked.since.unwrap();
    assert!(since.objects.new >= model.parts.len() / 5 && since.objects.gone == since.objects.new, "{since}");
    judge(&baked, &fresh(&scene), "renamed");
    let bytes: Vec<Vec<u8>> = [1, 4].map(|threads| on(threads, || again(&scene, &last).file.write())).to_vec();
    assert!(bytes[0] == bytes[1] && bytes[0] == baked.file.write());
}

/// What the command takes from the last bake, and what it says of it.
#[test]
fn the_command_goes_on_from_its_last_bake() {
    let folder = folder("edit");
    let (mut model, mut random) = model();
    let (path, out) = (folder.join("m.obj"), folder.join("m.pvs"));
    let write = |model: &Model| std::fs::write(&path, testing::edits::obj(model)).unwrap();
    let said = |more: &[&str]| {
        let out = run_words(&[&["bake", text(&path), "-o", text(&out), "--rays", "20k"], more].concat());
        done(&out);
        String::from_utf8([out.stdout, out.stderr].concat()).unwrap()
    };
    write(&model);
    assert!(!said(&[]).contains("since the last bake"));
    let first = std::fs::read(&out).unwrap();
    model.move_furniture(&mut random);
    write(&model);
    let told = said(&[]);
    assert!(told.contains("since the last bake: objects 1 moved, "), "{told}");
    let second = std::fs::read(&out).unwrap();
    assert!(said(&[]).contains("unchanged"));
    // The same from a file of another name, which stays as it is.
    let old = folder.join("old.pvs");
    std::fs::write(&old, &first).unwrap();
    std::fs::remove_file(&out).unwrap();
    let told = json(&run_words(&["bake", text(&path), "-o", text(&out), "--rays", "20k", "--from", text(&old), "--json"]));
    assert_eq!((&told["since"]["moved"], &told["since"]["gone"]), (&1.into(), &0.into()), "{}", told["since"]);
    assert!(std::fs::read(&out).unwrap() == second && std::fs::read(&old).unwrap() == first);
    // Other options, another model, a damaged file: nothing is taken, which is said of a file that was named, and of a damaged one.
    assert!(!said(&["--seed", "3"]).contains("since the last bake"));
    let told = said(&["--from", text(&old), "--seed", "4"]);
    assert!(told.contains("nothing taken from") && told.contains("other options"), "{told}");
    let mut damaged = first.clone();
    damaged[200] ^= 1;
    std::fs::write(&out, &damaged).unwrap();
    let told = said(&[]);
    assert!(told.contains("all is baked") && told.contains("m.pvs") && !told.contains("since the last"), "{told}");
    std::fs::write(&out, &damaged).unwrap();
    let refused = run_words(&["bake", text(&path), "-o", text(&folder.join("x.pvs")), "--from", text(&out)]);
    assert_eq!(refused.status.code(), Some(2));
    let villa = building("villa_rotonda.glb");
    let other = run_words(&["bake", text(&villa), "-o", text(&folder.join("v.pvs")), "--rays", "20k", "--from", text(&old)]);
    done(&other);
    let told = String::from_utf8([other.stdout, other.stderr].concat()).unwrap();
    assert!(told.contains("nothing taken from") && told.contains("in common"), "{told}");
}
