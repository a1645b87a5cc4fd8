//! In: the text of a shader. Out: the same with a bound on the turns that all loops of one invocation may take.

use super::tokens::{Kind, tokens};

/// Turns that an invocation has taken.
const COUNTER: &str = "shader_twin_turns";

/// Behind the braces that open loop bodies, bytes, in the order of the text.
fn bodies(text: &str) -> Vec<usize> {
    let all = tokens(text);
    let is_loop =
        |i: &usize| all[*i].kind == Kind::Word && ["for", "while", "loop"].contains(&&text[all[*i].at.clone()]);
    // Neither the head of a loop nor an attribute can hold a brace.
    let brace = |i: usize| all[i..].iter().find(|t| &text[t.at.clone()] == "{").map(|t| t.at.end);
    (0..all.len()).filter(is_loop).filter_map(brace).collect()
}

/// Whether a text has a loop.
pub(super) fn has_loops(text: &str) -> bool {
    !bodies(text).is_empty()
}

/// The text in which every loop ends once the invocation has taken this many turns, all loops counted together. Lines
/// stay lines.
///
/// A `break` fits every loop: naga refuses a function with a result that a loop without `break` ends.
pub(super) fn bounded(text: &str, turns: u32) -> String {
    let places = bodies(text);
    if places.is_empty() {
        return text.to_owned();
    }
    let mut out = text.to_owned();
    for at in places.into_iter().rev() {
        out.insert_str(at, &format!(" {COUNTER} += 1u; if {COUNTER} > {turns}u {{ break; }}"));
    }
    out + &format!("\nvar<private> {COUNTER}: u32;\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::parsed;

    const TEXT: &str = "
@group(0) @binding(0) var<storage, read_write> words: array<u32>;
fn first(begin: u32) -> u32 { loop { if words[begin] > 3u { break; } } return begin; }
@compute @workgroup_size(1)
fn main() {
    for (var i = 0u; i < 4u; i++) { words[i] = i; }
    while words[0] < 9u { words[0] += 1u; } // for {
    loop { words[1] += first(0u); continuing { break if words[1] > 5u; } }
}";

    #[test]
    fn every_loop_gets_a_bound() {
        assert!(has_loops(TEXT));
        let text = bounded(TEXT, 77);
        assert_eq!(text.matches("{ shader_twin_turns += 1u; if shader_twin_turns > 77u { break; }").count(), 4);
        assert_eq!(parsed(&text).err(), None);
        assert_eq!(text.lines().nth(6).unwrap().split('{').next(), TEXT.lines().nth(6).unwrap().split('{').next());
    }

    /// What the choice of `break` rests on.
    #[test]
    fn a_function_with_a_result_that_a_loop_without_break_ends_is_refused() {
        assert!(parsed("fn f(a: u32) -> u32 { loop { if a > 3u { return a; } } }").is_err());
    }

    #[test]
    fn a_shader_without_loops_stays_as_it_is() {
        let text = "@compute @workgroup_size(1) fn main() {}";
        assert!(!has_loops(text));
        assert_eq!(bounded(text, 5), text);
    }
}
