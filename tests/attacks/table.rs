//! In: cases with what is expected of them. Out: the table of what was got, and a failure where they differ.
//! Frame and unit: seconds, MB.

use crate::common::process::{most_held_mb, processor_seconds};
use sheetlight::fault::Fault;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::channel;
use std::time::Duration;

/// Processor time that an answer may take.
const MOST_SECONDS: f64 = 5.0;
/// No answer after this: a hang, on however busy a machine.
const HANGS: Duration = Duration::from_secs(120);
/// Memory that the whole process may ever have held.
const MOST_MB: u64 = 512;

/// What is to come of a case.
pub enum Want {
    Good,
    /// A fault that says these of what happened and of its cause.
    Says(&'static [&'static str]),
}

pub use Want::Good;

pub struct Case {
    name: String,
    want: Want,
    run: Box<dyn FnOnce() -> Result<(), Fault> + Send>,
}

pub fn case<T>(name: impl Into<String>, want: Want, run: impl FnOnce() -> Result<T, Fault> + Send + 'static) -> Case {
    Case { name: name.into(), want, run: Box::new(move || run().map(drop)) }
}

/// Runs the cases one by one, each on a thread of its own, prints the table, and fails where a row is not as expected.
pub fn check(cases: Vec<Case>) {
    let (mut text, mut wrong) = (String::new(), 0);
    for Case { name, want, run } in cases {
        let (tell, told) = channel();
        std::thread::spawn(move || {
            let before = processor_seconds();
            let answer = catch_unwind(AssertUnwindSafe(run));
            // Nobody listens any more after a hang.
            let _ = tell.send((answer, processor_seconds() - before));
        });
        let (got, good) = match told.recv_timeout(HANGS) {
            Err(_) => (format!("no answer after {} s", HANGS.as_secs()), false),
            Ok((Err(_), _)) => ("a panic".into(), false),
            Ok((_, seconds)) if seconds > MOST_SECONDS => (format!("an answer after {seconds:.1} s"), false),
            Ok((Ok(Ok(())), seconds)) => (format!("good, {seconds:.2} s"), matches!(want, Good)),
            Ok((Ok(Err(fault)), _)) => {
                let said = format!("{} {}", fault.what, fault.cause);
                let fits = matches!(want, Want::Says(words) if words.iter().all(|w| said.contains(w)));
                (fault.to_string().replace('\n', " |"), fits && !fault.next.is_empty())
            }
        };
        let expected = match want {
            Good => "good".into(),
            Want::Says(words) => format!("fault: {}", words.join(", ")),
        };
        wrong += usize::from(!good);
        let mark = if good { "ok   " } else { "WRONG" };
        let short: String = got.chars().take(300).collect();
        writeln!(text, "{mark} {name:34} | {expected:44} | {short}").expect("a string takes it");
    }
    let held = most_held_mb();
    println!("{text}most memory held so far: {held} MB");
    assert!(held < MOST_MB, "{held} MB of memory, limit {MOST_MB}");
    assert!(wrong == 0, "{wrong} cases are not answered as expected\n{text}");
}
