//! What stages can use: override constants with and without `@id`, groups, a tail behind a struct, sizes of buffers,
//! what an adapter refuses.

mod common;

use shader_twin::{Binding, Case, Kind, Layout, Pair, Shape, Stage, Tolerance, Words, layout};

fn exact() -> Tolerance {
    Tolerance::exact("whole numbers")
}

fn words(name: &str) -> Binding {
    Binding::read_write(name, Shape::array::<u32>(), exact())
}

#[test]
fn override_constants_reach_the_shader_by_name_and_by_id() {
    let Some(device) = common::device() else { return };
    let text = "override step: u32 = 3u;
        @id(7) override width: u32;
        @group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(width) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            words[id.x] = step * (id.x + 1u);
        }";
    let twin = |b: &mut [Words], case: &Case| {
        let step = case.constant("step").unwrap_or(3.0) as u32;
        (1..).zip(b[0].get_mut::<u32>()).for_each(|(i, word)| *word = step * i);
    };
    let case = |name| Case::new(name, [2, 1, 1]).zeros(16).set("width", 8.0);
    let stage = Stage::new("steps", text, "main", [8, 1, 1], vec![words("words")]).overrides(&["step", "width"]);
    let pair = Pair::new(stage.clone(), twin, vec![case("default"), case("five").set("step", 5.0)]);
    assert!(pair.compare(&device).unwrap().passed());
    // The twin reads the case's constant: a device that kept the default would differ.
    let wrong = move |b: &mut [Words], case: &Case| twin(b, &Case { overrides: vec![], ..case.clone() });
    let cases = vec![case("five").set("step", 5.0)];
    assert!(!Pair::new(stage, wrong, cases).compare(&device).unwrap().passed());
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Head {
    length: u32,
    capacity: u32,
}

/// A list in group 2, nothing in group 1: indices of the odd words, of which each invocation finds the place itself.
#[test]
fn groups_and_a_tail_are_bound_and_array_lengths_are_those_of_the_case() {
    let Some(device) = common::device() else { return };
    let text = "struct List { length: u32, capacity: u32, entries: array<u32> }
        @group(0) @binding(3) var<storage, read> given: array<u32>;
        @group(2) @binding(1) var<storage, read_write> list: List;
        @compute @workgroup_size(32) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x >= arrayLength(&given) { return; }
            var place = 0u;
            for (var i = 0u; i < id.x; i++) { place += given[i] & 1u; }
            if (given[id.x] & 1u) == 1u && place < arrayLength(&list.entries) { list.entries[place] = id.x; }
            if id.x == arrayLength(&given) - 1u {
                list.length = place + (given[id.x] & 1u);
                list.capacity = arrayLength(&list.entries);
            }
        }";
    let twin = |b: &mut [Words], _: &Case| {
        let [given, list] = b else { unreachable!() };
        let odd: Vec<u32> = (0..).zip(given.get::<u32>()).filter(|(_, w)| *w % 2 == 1).map(|(i, _)| i).collect();
        let [length, capacity, entries @ ..] = list.get_mut::<u32>() else { unreachable!() };
        (*length, *capacity) = (odd.len() as u32, entries.len() as u32);
        entries.iter_mut().zip(odd).for_each(|(e, i)| *e = i);
    };
    let list = Shape::Tail(layout!(Head { length, capacity }), "entries", Layout::of::<u32>());
    let bindings = vec![
        Binding::read("given", Shape::array::<u32>()).at(0, 3),
        Binding::read_write("list", list, exact()).at(2, 1),
    ];
    let case = |name: &str, given: &[u32], room: usize| {
        Case::new(name, [(given.len() as u32).div_ceil(32), 1, 1]).with(given).zeros(2 + room)
    };
    let numbers: Vec<u32> = (0..77).map(|i: u32| i * i / 3).collect();
    let cases = vec![case("room for all", &numbers, 77), case("room for 5", &numbers, 5), case("one", &[3], 1)];
    let pair = Pair::new(Stage::new("odd", text, "main", [32, 1, 1], bindings), twin, cases);
    let comparison = pair.compare(&device).unwrap();
    assert!(comparison.passed(), "{comparison:#?}");
}

#[test]
fn what_the_adapter_cannot_do_is_refused_with_the_number_and_the_limit() {
    let Some(device) = common::device() else { return };
    let text = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(16384, 2, 1) fn main() { words[0] = 1u; }";
    let twin = |b: &mut [Words], _: &Case| b[0].get_mut::<u32>()[0] = 1;
    let stage = Stage::new("huge", text, "main", [16384, 2, 1], vec![words("words")]);
    let pair = Pair::new(stage, twin, vec![Case::new("c", [1, 1, 1]).zeros(1)]);
    let refused = pair.compare(&device).unwrap_err();
    assert_eq!(refused.kind(), Kind::Refused);
    assert!(refused.what().contains("huge: the shader cannot be compiled") && refused.what().contains("16384"));
    // The device is as good as before.
    let small = |pair: Pair| pair.compare(&device).map(|c| c.passed());
    let text = text.replace("16384, 2, 1", "1");
    let stage = Stage::new("small", &text, "main", [1, 1, 1], vec![words("words")]);
    assert_eq!(small(Pair::new(stage.clone(), twin, vec![Case::new("c", [1, 1, 1]).zeros(1)])), Ok(true));
    let refused = small(Pair::new(stage, twin, vec![Case::new("c", [u32::MAX, 1, 1]).zeros(1)])).unwrap_err();
    assert!(refused.what().contains("4294967295"), "{refused}");
}

#[test]
fn a_twin_that_changes_what_the_shader_only_reads_is_refused() {
    let Some(device) = common::device() else { return };
    let text = "@group(0) @binding(0) var<storage, read> given: array<u32>;
        @group(0) @binding(1) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn main() { words[0] = given[0]; }";
    let twin = |b: &mut [Words], _: &Case| b.iter_mut().for_each(|words| words.get_mut::<u32>()[0] = 5);
    let bindings = vec![Binding::read("given", Shape::array::<u32>()), words("words")];
    let case = Case::new("c", [1, 1, 1]).with(&[4u32]).zeros(1);
    let refused = Pair::new(Stage::new("s", text, "main", [1, 1, 1], bindings), twin, vec![case]).compare(&device);
    assert_eq!(refused.unwrap_err().what(), "s: the twin changes 'given', which the shader only reads");
}

/// Invocations take places in the order in which they come: only the set of numbers is the same.
#[test]
fn a_list_in_any_order_is_judged_by_a_rule() {
    let Some(device) = common::device() else { return };
    let text = "@group(0) @binding(0) var<storage, read_write> count: atomic<u32>;
        @group(0) @binding(1) var<storage, read_write> list: array<u32>;
        @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x % 3u == 1u { list[atomicAdd(&count, 1u)] = id.x; }
        }";
    // Last number first, which no device is likely to do.
    let twin = |b: &mut [Words], _: &Case| {
        let numbers: Vec<u32> = (0..256).rev().filter(|i| i % 3 == 1).collect();
        b[0].get_mut::<u32>()[0] = numbers.len() as u32;
        b[1].get_mut::<u32>()[..numbers.len()].copy_from_slice(&numbers);
    };
    let sorted = |b: &[Words]| {
        let mut list = b[1].get::<u32>().to_vec();
        list.sort_unstable();
        (b[0].get::<u32>()[0], list)
    };
    let rule = move |_: &Case, device: &[Words], twin: &[Words]| f64::from(u8::from(sorted(device) != sorted(twin)));
    let bindings = || vec![Binding::read_write("count", Shape::One(Layout::of::<u32>()), exact()), words("list")];
    let stage = || Stage::new("thirds", text, "main", [64, 1, 1], bindings());
    let cases = || vec![Case::new("c", [4, 1, 1]).zeros(1).zeros(100)];
    let any_order = Pair::new(stage(), twin, cases()).judged_by(rule, 0.0, "the order of invocations is not defined");
    let outcome = any_order.run(&device);
    assert!(outcome.passed() && outcome.mutants.as_ref().unwrap().killed >= 8, "{outcome}");
    assert!(!Pair::new(stage(), twin, cases()).compare(&device).unwrap().passed());
    let silent = Pair::new(stage(), twin, cases()).judged_by(rule, 0.0, "").check();
    assert_eq!(silent[0].what(), "thirds: the stage's own rule has no reason");
}
