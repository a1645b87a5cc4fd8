//! Sums of blocks on the device and on the CPU, with mutants of the shader. From the repository's root:
//!
//! ```console
//! cargo run --package shader-twin --example prefix_sum
//! ```
//!
//! SHADER_TWIN_ADAPTER=software (or gpu, or a part of a name) asks for an adapter. The report goes to
//! target/shader-twin, or to the folder of the first argument.

use shader_twin::{Binding, Case, Device, Pair, Report, Shape, Stage, Tolerance, Wanted, Words, layout};
use std::error::Error;
use std::path::Path;

/// Invocations of a workgroup, and numbers of a block.
const BLOCK: usize = 64;

/// The WGSL struct of the same name.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    count: u32,
    start: u32,
}

/// What the Rust side believes of the shader.
fn stage() -> Stage {
    let exact = || Tolerance::exact("whole numbers are added, in any order with the same result");
    Stage::new(
        "prefix sum",
        include_str!("prefix_sum.wgsl"),
        "main",
        [BLOCK as u32, 1, 1],
        vec![
            Binding::uniform("params", Shape::One(layout!(Params { count, start }))),
            Binding::read("given", Shape::array::<u32>()),
            Binding::read_write("sums", Shape::array::<u32>(), exact()),
            Binding::read_write("totals", Shape::array::<u32>(), exact()),
        ],
    )
}

/// The same arithmetic, one number after the other.
fn twin(bindings: &mut [Words], _: &Case) {
    let [params, given, sums, totals] = bindings else { unreachable!("the stage has four bindings") };
    let Params { count, start } = params.get::<Params>()[0];
    let given = &given.get::<u32>()[..count as usize];
    let (sums, totals) = (sums.get_mut::<u32>(), totals.get_mut::<u32>());
    for (block, total) in totals.iter_mut().enumerate() {
        *total = start;
        for i in block * BLOCK..given.len().min((block + 1) * BLOCK) {
            *total = total.wrapping_add(given[i]);
            sums[i] = *total;
        }
    }
}

/// A case of this many numbers; more words behind them show whether the shader writes there.
fn case(name: &str, start: u32, given: &[u32]) -> Case {
    let groups = given.len().div_ceil(BLOCK);
    let params = Params { count: given.len() as u32, start };
    let padded: Vec<u32> = given.iter().copied().chain([77; 3]).collect();
    Case::new(name, [groups as u32, 1, 1]).with(&[params]).with(&padded).zeros(padded.len()).zeros(groups)
}

fn cases() -> Vec<Case> {
    // Every bit of every number matters: a sum that lacks one or has one twice differs.
    let numbers = |n: u32| (1..=n).map(|i| i.wrapping_mul(2_654_435_761)).collect::<Vec<u32>>();
    vec![
        case("one number", 0, &numbers(1)),
        case("a block", 5, &numbers(64)),
        case("a block and one", 0, &numbers(65)),
        case("blocks and a part", 9, &numbers(300)),
    ]
}

fn pair() -> Pair {
    let turn = "for (var step = 1u; step < 64u; step <<= 1u) {";
    let far = "no invocation is 64 places behind the block's begin";
    Pair::new(stage(), twin, cases())
        .explain(turn, &turn.replace("< 64", "<= 64"), far)
        .explain(turn, &turn.replace("64u", "65u"), far)
        .explain(turn, &turn.replace("64u", "63u"), "steps are powers of two: 32 is the last one either way")
}

/// Runs everything on a device and writes the report into a folder.
pub fn run(device: &Device, folder: &Path) -> Result<Report, shader_twin::Error> {
    let mut report = Report::new("Prefix sum", device);
    report.add(pair().run(device));
    report.write(folder)?;
    Ok(report)
}

pub fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/shader-twin".into());
    let report = run(&Device::open(&Wanted::from_env()?)?, Path::new(&folder))?;
    println!("{report}");
    if report.passed() { Ok(()) } else { Err("the prefix sum did not pass".into()) }
}
