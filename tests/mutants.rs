//! In: every stage's shader with its cases and its twin. Out: which changes of one operator or constant of the shader
//! no case notices. Frame and unit: words of the stages' bindings.
//!
//! One small stage is always tried. SHEETLIGHT_LONG=1 tries all of them, which compiles thousands of shaders, and lists
//! the changes that were not noticed; SHEETLIGHT_STAGES=point,thin tries these alone.

mod common;

use naga::{AddressSpace, ArraySize, GlobalVariable, Handle, Module, StorageAccess, Type, TypeInner};
use shader_twin::{Binding, Device, Field, Layout, Pair, Shape, Stage, Tolerance, Wanted, Words};
use sheetlight::stages::{self, Entry};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// Changes of each shader that no case notices on Mesa's software adapter. Many compute the same: the remainder of a
/// workgroup does nothing, a bound is never reached. The numbers may only fall. Another adapter treats what lies beyond
/// the end of a buffer otherwise, so that its numbers are not compared. A shader without a number here has not been
/// tried to its end yet: it is printed and not judged.
const MOST: [(&str, usize); 25] = [
    ("ambient", 13),
    ("clear", 2),
    ("compact", 11),
    ("count", 2),
    ("gather", 16),
    ("grid_pick", 10),
    ("grid_span", 46),
    ("grid_sum", 49),
    ("header", 5),
    ("hough", 1),
    ("lines", 1),
    ("point", 104),
    ("rebase", 2),
    ("reset", 5),
    ("scan_rows", 3),
    ("scan_shots", 3),
    ("shape_peaks", 14),
    ("shape_quantise", 19),
    ("shape_score", 16),
    ("shape_spread", 4),
    ("skeleton", 3),
    ("skeleton_copy", 2),
    ("stats", 28),
    ("support", 18),
    ("tiles", 72),
];

#[test]
fn the_cases_notice_changed_shaders() {
    // The library's own way of choosing: a missing adapter is a failure where one is required.
    if common::device().is_none() {
        return;
    }
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let wanted = std::env::var("SHEETLIGHT_STAGES").unwrap_or(if long { "" } else { "rebase" }.into());
    let wanted: Vec<&str> = wanted.split(',').filter(|w| !w.is_empty()).collect();
    let named = std::env::var("SHEETLIGHT_ADAPTER").unwrap_or_default();
    let device = Device::open(&Wanted::parse(&named)).unwrap();
    let counted = device.adapter().name.starts_with("llvmpipe");
    // A comparison of what a mutant wrote may panic, which notices the mutant; its message helps nobody.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| ()));
    let (mut wrong, mut all, mut survived) = (Vec::new(), 0, 0);
    for entry in stages::all().into_iter().filter(|e| wanted.is_empty() || wanted.contains(&e.stage.name)) {
        let (name, begin) = (entry.stage.name, Instant::now());
        let mutants = pair(entry).mutate(&device);
        let seconds = begin.elapsed().as_secs_f64();
        let Ok(mutants) = mutants.map_err(|e| wrong.push(format!("{name}: {e}"))) else { continue };
        println!("{name:20} {seconds:6.1} s  {}", mutants.line());
        mutants.survivors.iter().for_each(|mutant| println!("    {}", mutant.line()));
        let survivors = mutants.survivors.len();
        (all, survived) = (all + mutants.total(), survived + survivors);
        let most = MOST.iter().find(|m| m.0 == name).map(|m| m.1);
        if counted && most.is_some_and(|most| survivors > most) {
            wrong.push(format!(
                "{name}: {survivors} changes were not noticed, {} are allowed",
                most.unwrap_or_default()
            ));
        }
    }
    std::panic::set_hook(hook);
    println!("{} of {all} changed shaders were noticed, {survived} were not", all - survived);
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(all > 0, "no stage is called {wanted:?}");
}

/// A stage with its twin, cases and rule, as the kit takes them.
fn pair(entry: Entry) -> Pair {
    let module = naga::front::wgsl::parse_str(&entry.stage.source()).unwrap();
    let bindings: Vec<Binding> = (0..entry.stage.bindings.len()).map(|i| binding(&module, i as u32)).collect();
    let mut cases = (entry.cases)();
    for (i, case) in cases.iter_mut().enumerate() {
        case.name = format!("{i}: {}", case.name);
    }
    let given = cases.iter().map(|case| given(&bindings, case)).collect();
    let stage = Stage::new(entry.stage.name, &entry.stage.source(), "main", entry.stage.workgroup, bindings)
        .overrides(entry.stage.overrides);
    let same = entry.same;
    let twin_cases = cases.clone();
    let of = |cases: &[stages::Case], name: &str| cases.iter().find(|c| c.name == name).cloned().unwrap();
    let twin = move |words: &mut [Words], case: &shader_twin::Case| {
        let case = of(&twin_cases, &case.name);
        let mut bindings = case.bindings.clone();
        (entry.twin)(&mut bindings, &case.overrides);
        for (words, binding) in words.iter_mut().zip(&bindings) {
            let words = words.get_mut::<u32>();
            let most = words.len().min(binding.len());
            words[..most].copy_from_slice(&binding[..most]);
        }
    };
    let rule = move |case: &shader_twin::Case, device: &[Words], twin: &[Words]| {
        let case = of(&cases, &case.name);
        let [device, twin] = [device, twin].map(|words| own_words(&case, words));
        catch_unwind(AssertUnwindSafe(|| same.difference(&device, &twin))).unwrap_or(f64::INFINITY)
    };
    // A machine at work compiles a large shader for many seconds; only a loop without end takes minutes.
    Pair::new(stage, twin, given).judged_by(rule, same.limit(), same.reason()).time_limit(Duration::from_secs(120))
}

/// What the kit binds: stages bind multiples of 16 bytes, and a struct has its own size.
fn given(bindings: &[Binding], case: &stages::Case) -> shader_twin::Case {
    let mut out = shader_twin::Case::new(&case.name, case.groups);
    for (binding, words) in bindings.iter().zip(&case.bindings) {
        let mut words = words.clone();
        match &binding.shape {
            Shape::One(layout) => words.resize(layout.bytes / 4, 0),
            _ => words.resize(words.len().max(1).next_multiple_of(4), 0),
        }
        out = out.with(&words);
    }
    case.overrides.iter().fold(out, |out, (name, value)| out.set(name, *value))
}

/// As many words of each binding as the case has; what the kit did not bind stayed as it was.
fn own_words(case: &stages::Case, words: &[Words]) -> Vec<Vec<u32>> {
    let one = |(own, words): (&Vec<u32>, &Words)| {
        let words: &[u32] = words.get();
        let most = words.len().min(own.len());
        [&words[..most], &own[most..]].concat()
    };
    case.bindings.iter().zip(words).map(one).collect()
}

/// The declaration of a binding as its WGSL text has it: tests/shader_contracts.rs compares that with the stage.
fn binding(module: &Module, number: u32) -> Binding {
    let at = |g: &&GlobalVariable| g.binding.as_ref().is_some_and(|b| b.binding == number);
    let global = module.global_variables.iter().map(|(_, g)| g).find(at).unwrap();
    let (name, shape) = (global.name.as_deref().unwrap(), shape(module, global.ty));
    match global.space {
        AddressSpace::Uniform => Binding::uniform(name, shape),
        AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
            Binding::read_write(name, shape, Tolerance::exact("the stage's own rule judges it"))
        }
        _ => Binding::read(name, shape),
    }
}

fn shape(module: &Module, ty: Handle<Type>) -> Shape {
    match module.types[ty].inner {
        TypeInner::Array { base, size: ArraySize::Dynamic, .. } => Shape::Array(layout(module, base)),
        TypeInner::Array { base, size: ArraySize::Constant(n), .. } => Shape::Fixed(layout(module, base), n.get()),
        _ => Shape::One(layout(module, ty)),
    }
}

fn layout(module: &Module, ty: Handle<Type>) -> Layout {
    let bytes = |ty: Handle<Type>| module.types[ty].inner.size(module.to_ctx()) as usize;
    let TypeInner::Struct { members, .. } = &module.types[ty].inner else {
        return Layout { name: "value", bytes: bytes(ty), fields: Vec::new() };
    };
    // The kit keeps names of Rust types, which live as long as the program.
    let kept = |name: &Option<String>| -> &'static str { Box::leak(name.clone().unwrap().into_boxed_str()) };
    let field = |m: &naga::StructMember| Field { name: kept(&m.name), offset: m.offset as usize, bytes: bytes(m.ty) };
    Layout { name: kept(&module.types[ty].name), bytes: bytes(ty), fields: members.iter().map(field).collect() }
}
