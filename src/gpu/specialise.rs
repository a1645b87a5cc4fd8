//! In: a stage's WGSL and the values of its override constants. Out: its naga module with these values inserted and
//! without the branches that they rule out. Arrays that have a reader function are read as texels. Frame and unit:
//! none.
//!
//! A driver first inlines every call and only then finds dead code; until then each of its passes works on all of it.
//! Mesa's software adapter (22.3) pays for that at every start: its cache on disk saves only the machine code that
//! follows.

use super::texels::{bind_images, read_texels};
use naga::back::pipeline_constants::process_overrides;
use naga::compact::{KeepUnused, compact};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Arena, Block, Expression, Literal, Module, ShaderStage, Statement};
use wgpu::naga;

pub(super) fn specialised(source: &str, overrides: &[(String, f64)]) -> Module {
    let parsed = naga::front::wgsl::parse_str(source);
    let mut module = parsed.unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)));
    bind_images(&mut module);
    // The device validates the result. Here validation only gives the types.
    let types = |module: &Module| {
        let info = Validator::new(ValidationFlags::empty(), Capabilities::all()).validate(module);
        info.unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)))
    };
    let mut info = types(&module);
    // Must come before the values are inserted: functions that nobody calls, as the readers are until now, are removed
    // then.
    if read_texels(&mut module, &info) {
        info = types(&module);
    }
    let values = overrides.iter().cloned().collect();
    let main = Some((ShaderStage::Compute, "main"));
    let (module, _) = process_overrides(&module, &info, main, &values).unwrap_or_else(|e| panic!("{e}"));
    let mut module = module.into_owned();
    let functions = module.functions.iter_mut().map(|(_, f)| f);
    for f in functions.chain(module.entry_points.iter_mut().map(|e| &mut e.function)) {
        keep_live(&mut f.body, &f.expressions);
    }
    compact(&mut module, KeepUnused::No);
    module
}

/// Replaces every `if` with a constant condition by the branch that is taken.
fn keep_live(block: &mut Block, expressions: &Arena<Expression>) {
    for (mut statement, span) in std::mem::take(block).span_into_iter() {
        match &mut statement {
            Statement::Block(body) => keep_live(body, expressions),
            Statement::Loop { body, continuing, .. } => {
                keep_live(body, expressions);
                keep_live(continuing, expressions);
            }
            Statement::Switch { cases, .. } => cases.iter_mut().for_each(|c| keep_live(&mut c.body, expressions)),
            Statement::If { condition, accept, reject } => {
                keep_live(accept, expressions);
                keep_live(reject, expressions);
                if let Expression::Literal(Literal::Bool(taken)) = expressions[*condition] {
                    block.append(if taken { accept } else { reject });
                    continue;
                }
            }
            _ => {}
        }
        block.push(statement, span);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_constants_rule_out_is_gone_and_all_else_stays() {
        let text = "
@group(0) @binding(0) var<storage, read_write> words: array<u32>;
override method: u32 = 0u;
fn chosen(i: u32) { words[i] = 7u; }
fn other(i: u32) { words[i] = 9u; }
@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    for (var i = 0u; i < id.x; i++) {
        if method == 1u { chosen(i); } else { other(i); }
        if words[i] == 3u { break; }
    }
}";
        let kept = |value: f64| {
            let module = specialised(text, &[("method".into(), value)]);
            assert!(module.overrides.is_empty());
            module.functions.iter().map(|(_, f)| f.name.clone().unwrap()).collect::<Vec<_>>()
        };
        assert_eq!(kept(1.0), ["chosen"]);
        assert_eq!(kept(0.0), ["other"]);
        let main = format!("{:?}", specialised(text, &[]).entry_points[0].function.body);
        // The end of the loop and the test of the word, each with its break; not the choice of the method.
        assert_eq!((main.matches("If {").count(), main.matches("Break").count()), (2, 2), "{main}");
    }
}
