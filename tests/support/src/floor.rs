//! The rows of a floor of rooms.

use crate::random::Random;
use enfilade::BitMatrix;

/// Rooms and what each sees.
pub struct Floor {
    /// Of each room, whether a door leads on along x and along z.
    pub doors: Vec<[bool; 2]>,
    pub cells: BitMatrix,
    pub objects: BitMatrix,
}

/// A floor of `side` x `side` rooms with so many objects each, most doors open at random: a room sees along its row and its column until a door
/// is shut, and of the objects that stand there the fewer the further they are.
pub fn floor(side: usize, objects_each: usize) -> Floor {
    let (random, rooms) = (&mut Random::new(9), side * side);
    let doors: Vec<[bool; 2]> = (0..rooms).map(|_| [(); 2].map(|()| random.below(5) > 0)).collect();
    // How far along the line of sight an object is still seen.
    let reach: Vec<usize> = (0..rooms * objects_each).map(|_| 1 + random.below(9)).collect();
    let (mut cells, mut objects) = (BitMatrix::new(rooms, rooms), BitMatrix::new(rooms, rooms * objects_each));
    for room in 0..rooms {
        let mut see = |other: usize, far: usize| {
            cells.set(room, other);
            let there = other * objects_each..(other + 1) * objects_each;
            there.filter(|&object| reach[object] > far).for_each(|object| _ = objects.set(room, object));
        };
        see(room, 0);
        for (axis, step, place) in [(0, 1, room % side), (1, side, room / side)] {
            // A room's doors lead on, to greater numbers.
            (1..side - place).take_while(|k| doors[room + (k - 1) * step][axis]).for_each(|k| see(room + k * step, k));
            (1..=place).take_while(|k| doors[room - k * step][axis]).for_each(|k| see(room - k * step, k));
        }
    }
    Floor { doors, cells, objects }
}
