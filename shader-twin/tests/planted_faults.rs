//! A shader with one fault of each kind that the kit is for: each is found and named, and the right one passes.

mod common;

use shader_twin::{Binding, Case, Kind, Pair, Shape, Stage, Tolerance, Words, layout};

/// In: a row of levels. Out: each with the mean of its neighbours taken away, as far as `reach` goes.
const RIGHT: &str = "
struct Params {
    count: u32,
    reach: u32,
    scale: f32,
}
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> levels: array<f32>;
@group(0) @binding(2) var<storage, read_write> sharp: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= params.count {
        return;
    }
    let first = max(id.x, params.reach) - params.reach;
    let last = min(id.x + params.reach, params.count - 1u);
    var sum = 0.0;
    for (var i = first; i <= last; i++) {
        sum += levels[i];
    }
    sharp[id.x] = params.scale * (levels[id.x] - sum / f32(last - first + 1u));
}
";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    count: u32,
    reach: u32,
    scale: f32,
}

fn twin(bindings: &mut [Words], _: &Case) {
    let [params, levels, sharp] = bindings else { unreachable!() };
    let p: Params = params.get()[0];
    let levels: &[f32] = levels.get();
    for (i, out) in sharp.get_mut::<f32>().iter_mut().enumerate().take(p.count as usize) {
        let window = &levels[i.saturating_sub(p.reach as usize)..(i + p.reach as usize + 1).min(p.count as usize)];
        *out = p.scale * (levels[i] - window.iter().sum::<f32>() / window.len() as f32);
    }
}

fn case(name: &str, count: u32, reach: u32) -> Case {
    // Neighbouring levels differ in size: one more or less in a sum changes it by far more than rounding.
    let levels: Vec<f32> = (0..count + 3).map(|i| (i * i % 101) as f32 - 20.0).collect();
    let params = Params { count, reach, scale: 3.0 };
    let groups = count.div_ceil(64);
    Case::new(name, [groups, 1, 1]).with(&[params]).with(&levels).with(&vec![-5.0f32; levels.len()])
}

fn pair(wgsl: &str) -> Pair {
    let close = Tolerance::absolute(1e-4, "a device may divide and multiply with other rounding than the CPU");
    let bindings = vec![
        Binding::uniform("params", Shape::One(layout!(Params { count, reach, scale }))),
        Binding::read("levels", Shape::array::<f32>()),
        Binding::read_write("sharp", Shape::array::<f32>(), close),
    ];
    let cases = vec![case("one level", 1, 3), case("a workgroup", 64, 2), case("two and a part", 150, 5)];
    Pair::new(Stage::new("sharpen", wgsl, "main", [64, 1, 1], bindings), twin, cases)
}

/// The right shader with a fault in place of one part.
fn faulty(right: &str, wrong: &str) -> Pair {
    assert_eq!(RIGHT.matches(right).count(), 1, "{right}");
    pair(&RIGHT.replace(right, wrong))
}

#[test]
fn the_right_shader_passes() {
    assert_eq!(pair(RIGHT).check(), []);
    let Some(device) = common::device() else { return };
    let comparison = pair(RIGHT).compare(&device).unwrap();
    assert!(comparison.passed(), "{comparison:#?}");
    assert_eq!(comparison.cases.iter().map(|c| c.words).collect::<Vec<_>>(), [4, 67, 153]);
    assert_eq!(&comparison.adapter, device.adapter());
}

#[test]
fn a_wrong_layout_of_a_uniform_is_found() {
    // The size stays the same: only the members' places tell.
    let swapped = faulty("count: u32,\n    reach: u32,", "reach: u32,\n    count: u32,");
    let found = swapped.check();
    let first = found.first().map(|e| e.what()).unwrap_or_default();
    let expected = "sharpen: group 0, binding 0, 'params', member 0 is 'reach' at byte 0, 4 bytes in WGSL, \
                    'count' at byte 0, 4 bytes in Params";
    assert_eq!((found.len(), first), (1, expected));
    let padded = faulty("scale: f32", "@align(16) scale: f32").check();
    assert!(padded.iter().any(|e| e.what().contains("has 32 bytes in WGSL, 12 in Rust")), "{padded:?}");
    let Some(device) = common::device() else { return };
    assert_eq!(swapped.compare(&device).unwrap_err().kind(), Kind::Contract);
    let outcome = swapped.run(&device);
    assert!(!outcome.passed() && outcome.comparison.is_none(), "{outcome}");
}

#[test]
fn a_wrong_workgroup_size_is_found() {
    let found = faulty("@workgroup_size(64)", "@workgroup_size(32)").check();
    let said: Vec<&str> = found.iter().map(|e| e.what()).collect();
    assert_eq!(said, ["sharpen: @workgroup_size is [32, 1, 1] in WGSL, [64, 1, 1] in Rust"]);
    // A declaration that repeats the fault hides it from the contract, not from the cases.
    let mut both = faulty("@workgroup_size(64)", "@workgroup_size(32)");
    both.stage.workgroup = [32, 1, 1];
    assert_eq!(both.check(), []);
    let Some(device) = common::device() else { return };
    let comparison = both.compare(&device).unwrap();
    let failed: Vec<&str> = comparison.cases.iter().filter(|c| !c.passed()).map(|c| c.name.as_str()).collect();
    assert_eq!(failed, ["a workgroup", "two and a part"]);
}

#[test]
fn a_place_that_is_off_by_one_is_found() {
    let Some(device) = common::device() else { return };
    for (right, wrong) in [
        ("params.count - 1u)", "params.count)"),
        ("i <= last", "i < last"),
        ("id.x >= params.count", "id.x > params.count"),
        ("last - first + 1u", "last - first"),
    ] {
        let wrong = faulty(right, wrong);
        assert_eq!(wrong.check(), []);
        let outcome = wrong.run(&device);
        assert!(outcome.errors.is_empty() && !outcome.passed(), "{outcome}");
        assert!(outcome.to_string().contains("worst at sharp["), "{outcome}");
    }
}

#[test]
fn the_cases_notice_every_mutant_of_the_right_shader() {
    let Some(device) = common::device() else { return };
    let pair = pair(RIGHT);
    let mutants = pair.mutate(&device).unwrap();
    assert!(mutants.passed() && mutants.killed > 20, "{mutants:#?}");
}
