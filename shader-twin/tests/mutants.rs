//! Mutants of shaders: cases that are too weak, explanations, endless loops, a device that does not answer.

mod common;

use shader_twin::{Binding, Case, Kind, Pair, Shape, Stage, Tolerance, Words};
use std::time::{Duration, Instant};

const COUNTED: &str = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;

@compute @workgroup_size(1)
fn main() {
    var n = words[0];
    var sum = 0u;
    while n > 0u {
        n -= 1u;
        sum += n;
    }
    words[0] = sum;
}
";

fn words() -> Vec<Binding> {
    vec![Binding::read_write("words", Shape::array::<u32>(), Tolerance::exact("whole numbers"))]
}

fn counted(starts: &[u32]) -> Pair {
    let twin = |bindings: &mut [Words], _: &Case| {
        let word = &mut bindings[0].get_mut::<u32>()[0];
        *word = (0..*word).sum();
    };
    // A second word, because a mutant beyond the end of a buffer is noticed by some adapters only.
    let cases = starts.iter().map(|n| Case::new(&format!("from {n}"), [1, 1, 1]).with(&[*n, 99])).collect();
    Pair::new(Stage::new("counted", COUNTED, "main", [1, 1, 1], words()), twin, cases)
}

/// The one mutant of COUNTED that no case can notice.
fn explained(pair: Pair) -> Pair {
    pair.explain("while n > 0u {", "while n > 1u {", "the last turn adds 0")
}

/// Four of these mutants count for ever: from 0 downwards, upwards, or not at all. None may hold up the run.
#[test]
fn mutants_that_loop_without_end_are_ended_and_noticed() {
    let Some(device) = common::device() else { return };
    let begin = Instant::now();
    let mutants = explained(counted(&[7])).mutate(&device).unwrap();
    assert!(mutants.passed(), "{mutants:#?}");
    // `>`, `-=`, `+=` and the three numbers: two changes for each of `>`, `1u`; `0u` of the loop is explained.
    assert_eq!((mutants.killed, mutants.explained.len(), mutants.timed_out), (9, 1, 0), "{mutants:#?}");
    assert_eq!(mutants.turns, 256);
    assert!(begin.elapsed() < Duration::from_secs(60));
}

/// The bound is found from the cases: 5000 turns are more than the first two bounds.
#[test]
fn the_bound_grows_with_what_the_shader_needs() {
    let Some(device) = common::device() else { return };
    let mutants = counted(&[5000]).mutate(&device).unwrap();
    assert_eq!(mutants.turns, 4 * 16_384);
}

#[test]
fn a_mutant_that_the_cases_do_not_notice_is_listed_with_its_place() {
    let Some(device) = common::device() else { return };
    // One turn that adds 0 is no trial of the addition.
    let weak = explained(counted(&[1]));
    let mutants = weak.mutate(&device).unwrap();
    let lines: Vec<String> = mutants.survivors.iter().map(|m| m.line()).collect();
    assert!(lines.contains(&"line 9, column 13: '+=' -> '-=': sum -= n;".into()), "{lines:#?}");
    assert!(!mutants.passed() && !weak.run(&device).passed());
    assert!(explained(counted(&[1, 7])).run(&device).passed());
}

#[test]
fn an_explanation_that_no_survivor_needs_is_refused() {
    let Some(device) = common::device() else { return };
    let pair = explained(counted(&[7])).explain("sum += n;", "sum -= n;", "an old reason");
    let outcome = pair.run(&device);
    assert!(!outcome.passed());
    assert!(outcome.to_string().contains("'sum += n;' -> 'sum -= n;': an old reason"), "{outcome}");
}

#[test]
fn a_shader_that_fails_its_cases_has_no_mutants() {
    let Some(device) = common::device() else { return };
    let mut wrong = counted(&[2, 7]);
    wrong.stage.wgsl = COUNTED.replace("sum += n", "sum += n + 1u");
    let refused = wrong.mutate(&device).unwrap_err();
    assert_eq!(refused.kind(), Kind::Usage);
    assert!(refused.what().ends_with("the shader itself differs from its twin in case 'from 2'"), "{refused}");
}

#[test]
fn a_twin_that_does_nothing_is_refused() {
    let Some(device) = common::device() else { return };
    let text = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn main() { words[0] = words[0] + 0u; }";
    let cases = vec![Case::new("one", [1, 1, 1]).with(&[3u32])];
    let idle = Pair::new(Stage::new("idle", text, "main", [1, 1, 1], words()), |_, _| (), cases);
    let refused = idle.compare(&device).unwrap_err();
    assert_eq!(refused.kind(), Kind::Usage);
    assert!(refused.what().contains("changes no word in any case, at least 1 is needed"), "{refused}");
}

/// What only another entry point or no one uses gives no mutants, and neither does a default that is always replaced.
#[test]
fn changes_that_give_the_same_program_are_no_mutants() {
    let Some(device) = common::device() else { return };
    let text = "override factor: u32 = 3u;
        const UNUSED = 5u;
        @group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn other() { words[1] = 7u + 8u; }
        @compute @workgroup_size(1) fn main() { words[0] = words[0] ^ factor; }";
    let stage = Stage::new("xor", text, "main", [1, 1, 1], words()).overrides(&["factor"]);
    let twin = |bindings: &mut [Words], case: &Case| {
        bindings[0].get_mut::<u32>()[0] ^= case.constant("factor").unwrap() as u32;
    };
    let case = Case::new("one", [1, 1, 1]).with(&[9u32, 4]).set("factor", 5.0);
    let mutants = Pair::new(stage, twin, vec![case]).mutate(&device).unwrap();
    // Killed: `^` and both places of `words[0]`. The same: 2 of the default, 2 of UNUSED, 7 of the other entry point.
    assert_eq!((mutants.killed, mutants.same_program), (3, 2 + 2 + 7), "{mutants:#?}");
}

/// Work that no counter of turns bounds: the time limit ends the wait. The device is given up, and the next
/// run has a new one.
#[test]
fn a_device_that_does_not_answer_in_time_is_given_up() {
    let Some(device) = common::device() else { return };
    let text = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn main() {
            var x = words[0];
            for (var i = 0u; i < words[1]; i++) { x = (x ^ (x << 5u)) * 747796405u + i; }
            words[0] = x;
        }";
    // At least 20 ms on the fastest GPU: every turn needs the one before.
    let case = Case::new("many turns", [64, 1, 1]).with(&[1u32, 3_000_000]);
    let stage = Stage::new("slow", text, "main", [1, 1, 1], words());
    let twin = |b: &mut [Words], _: &Case| b[0].get_mut::<u32>()[0] += 1;
    let pair = Pair::new(stage, twin, vec![case]).time_limit(Duration::from_millis(1));
    // A busy machine may wake this thread only after the end.
    let refused = (0..5).find_map(|_| pair.compare(&device).err()).expect("a run that does not end in 1 ms");
    assert_eq!(refused.kind(), Kind::TimedOut);
    assert!(refused.what().contains("no end within 0.001 s"), "{refused}");
    // The next run opens it anew, whoever makes it.
    assert!(explained(counted(&[7])).run(&device).passed());
}
