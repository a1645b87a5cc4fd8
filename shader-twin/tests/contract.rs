//! Declarations that disagree with the shader: each kind is found by its own words. No device is needed.

use shader_twin::{Binding, Case, Field, Layout, Pair, Shape, Stage, Tolerance, layout};

const TEXT: &str = "
struct Frame { count: u32, scale: f32 }
struct Peak { place: vec2<f32>, level: f32, flags: u32 }
struct List { length: atomic<u32>, limit: u32, entries: array<Peak> }
override step: u32 = 1u;
@id(7) override width: u32;
@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> peaks: array<Peak>;
@group(1) @binding(4) var<storage, read_write> list: List;
@group(0) @binding(2) var<storage, read_write> table: array<vec4<u32>, 3>;
@compute @workgroup_size(width, 2)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    list.entries[id.x] = peaks[id.x];
    list.entries[id.x].level *= frame.scale;
    table[id.x % 3u].x += step;
    atomicAdd(&list.length, 1u);
}
@fragment fn shade() -> @location(0) vec4<f32> { return vec4(0.0); }
";

#[repr(C)]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Frame {
    count: u32,
    scale: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Peak {
    place: [f32; 2],
    level: f32,
    flags: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Head {
    length: u32,
    limit: u32,
}

fn peak() -> Layout {
    layout!(Peak { place, level, flags })
}

fn exact() -> Tolerance {
    Tolerance::exact("the same words")
}

fn stage() -> Stage {
    let list = Shape::Tail(layout!(Head { length, limit }), "entries", peak());
    let bindings = vec![
        Binding::uniform("frame", Shape::One(layout!(Frame { count, scale }))),
        Binding::read("peaks", Shape::Array(peak())),
        Binding::read_write("table", Shape::Fixed(Layout::of::<[u32; 4]>(), 3), exact()),
        Binding::read_write("list", list, exact()).at(1, 4).field("level", Tolerance::ulps(1, "one product")),
    ];
    Stage::new("peaks", TEXT, "main", [32, 2, 1], bindings).overrides(&["width", "step"])
}

fn case() -> Case {
    let bindings = Case::new("c", [1, 1, 1]).with(&[Frame::default()]).with(&[Peak::default()]).zeros(12);
    bindings.with(&[0u32; 2 + 4]).set("width", 32.0)
}

fn found(stage: Stage, case: Case) -> Vec<String> {
    let pair = Pair::new(stage, |_, _| (), vec![case]);
    pair.check().iter().map(|e| e.what().to_owned()).collect()
}

#[test]
fn a_declaration_that_agrees_gives_nothing() {
    assert_eq!(found(stage(), case()), [""; 0]);
}

type Change = Box<dyn Fn(&mut Stage)>;

/// What is changed in the declaration, and what is said.
#[test]
fn every_disagreement_is_named() {
    let changed = |change: &dyn Fn(&mut Stage)| {
        let mut stage = stage();
        change(&mut stage);
        found(stage, case())
    };
    let tail = |head: Layout, name: &'static str| {
        move |s: &mut Stage| s.bindings[3].shape = Shape::Tail(head.clone(), name, peak())
    };
    let wide = Layout { name: "Wide", bytes: 16, fields: vec![Field { name: "length", offset: 0, bytes: 4 }] };
    let changes: Vec<(Change, &str)> = vec![
        (
            Box::new(|s| s.entry = "other".into()),
            "there is no entry point 'other'; the shader has [\"main\", \"shade\"]",
        ),
        (Box::new(|s| s.entry = "shade".into()), "'shade' is not a compute shader"),
        (Box::new(|s| s.workgroup = [64, 2, 1]), "case 'c': @workgroup_size is [32, 2, 1] in WGSL, [64, 2, 1] in Rust"),
        (Box::new(|s| s.overrides = vec!["width".into()]), "override constants are [\"step\", \"width\"] in WGSL"),
        (Box::new(|s| s.bindings[0].name = "params".into()), "binding 0 is 'frame' in WGSL, 'params' in Rust"),
        (Box::new(|s| s.bindings[3].place = None), "'list' at group 1, binding 4 is not declared"),
        (Box::new(|s| s.bindings[3].place = None), "'list' is declared at group 0, binding 3; WGSL has nothing there"),
        (
            Box::new(|s| s.bindings[1] = Binding::read_write("peaks", Shape::Array(peak()), exact())),
            "'peaks', is var<storage, read> in WGSL, var<storage, read_write> in Rust",
        ),
        (
            Box::new(|s| s.bindings[0].shape = Shape::One(layout!(Frame { scale, count }))),
            "member 0 is 'count' at byte 0, 4 bytes in WGSL, 'scale' at byte 4, 4 bytes in Frame",
        ),
        (
            Box::new(|s| s.bindings[0].shape = Shape::One(layout!(Frame { count }))),
            "member 1 is 'scale' at byte 4, 4 bytes in WGSL, nothing in Frame",
        ),
        (Box::new(|s| s.bindings[0].shape = Shape::One(Layout::of::<[u32; 2]>())), "member 0 is 'count' at byte 0"),
        (Box::new(|s| s.bindings[0].shape = Shape::One(Layout::of::<u32>())), "has 8 bytes in WGSL, 4 in Rust"),
        (
            Box::new(|s| s.bindings[1].shape = Shape::array::<[f32; 3]>()),
            "'peaks', has elements 16 bytes apart in WGSL, 12 in Rust",
        ),
        (Box::new(|s| s.bindings[1].shape = Shape::One(peak())), "'peaks', is an array in WGSL, one Peak in Rust"),
        (
            Box::new(|s| s.bindings[2].shape = Shape::Fixed(Layout::of::<[u32; 4]>(), 4)),
            "'table', has 3 elements in WGSL, 4 in Rust",
        ),
        (
            Box::new(|s| s.bindings[2].shape = Shape::array::<[u32; 4]>()),
            "'table', is an array of fixed length in WGSL, a runtime-sized array in Rust",
        ),
        (
            Box::new(tail(layout!(Head { length, limit }), "items")),
            "'list', ends in 'entries' at byte 8 in WGSL, in 'items' at byte 8 in Rust",
        ),
        (Box::new(tail(wide, "entries")), "ends in 'entries' at byte 8 in WGSL, in 'entries' at byte 16 in Rust"),
        (
            Box::new(|s| s.bindings[3].fields[0].0 = "height".into()),
            "a tolerance is given for 'height', which its layout does not have",
        ),
        (
            Box::new(|s| s.bindings[2].tolerance = Some(Tolerance::exact(""))),
            "binding 'table': a tolerance (exact bits, limit 0) has no reason",
        ),
        (Box::new(|s| s.bindings[2].tolerance = None), "a tolerance is needed exactly where the shader writes"),
        (Box::new(|s| s.wgsl = TEXT.replace("list.length", "list.size")), "is not valid WGSL: error: "),
    ];
    for (change, expected) in changes {
        let said = changed(&*change);
        assert!(said.iter().any(|s| s.contains(expected)), "{expected}\n{said:#?}");
    }
}

#[test]
fn a_case_that_does_not_fit_the_declaration_is_named() {
    for (wrong, expected) in [
        (case().zeros(1), "peaks: case 'c': 5 bindings are given, 4 declared"),
        (case().set("height", 1.0), "peaks: case 'c': 'height' is set, which is no declared override constant"),
        (
            Case::new("c", [1, 1, 1]).zeros(2).zeros(5).zeros(12).zeros(6).set("width", 32.0),
            "peaks: case 'c': binding 'peaks' has 20 bytes; one or more Peak of 16 bytes are needed",
        ),
    ] {
        let said = found(stage(), wrong);
        assert!(said.iter().any(|s| s.replace("contract::", "") == expected), "{said:#?}");
    }
    let none = Pair::new(stage(), |_, _| (), Vec::new()).check();
    assert_eq!(none[0].what(), "peaks: 0 cases, at least 1 is needed");
}
