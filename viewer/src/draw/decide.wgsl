// What questions were asked about is drawn where the answer was that it shows: answers become the numbers of corners of indirect draws.

struct Slot {
    question: u32,
    first: u32,
    count: u32,
}

struct Draw {
    count: u32,
    instances: u32,
    first: u32,
    first_instance: u32,
}

// 64 bits each.
@group(0) @binding(0) var<storage, read> answers: array<vec2u>;
@group(0) @binding(1) var<storage, read> slots: array<Slot>;
@group(0) @binding(2) var<storage, read_write> draws: array<Draw>;

@compute @workgroup_size(64)
fn decide(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&slots) { return; }
    let slot = slots[id.x];
    let shows = any(answers[slot.question] != vec2u(0u));
    draws[id.x] = Draw(select(0u, slot.count, shows), 1u, slot.first, 0u);
}
