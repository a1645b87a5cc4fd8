//! In: this machine's processors and what the process may use of them. Out: the pool of threads that all parallel
//! work runs on.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use rayon::{ThreadBuilder, ThreadPoolBuilder};
use std::sync::mpsc::{Sender, channel};

/// More threads than this, and than four a processor, are a slip of the hand: a thread that finds no memory for its
/// signal stack takes the whole process with it.
const MOST: usize = 256;

/// Starts as many threads as there are processors, or as many of them as the process gets. rayon's own way is all or a
/// panic in whatever needs the first of them, and cannot be tried twice.
pub fn start() -> Result<()> {
    let wanted = std::thread::available_parallelism().map_or(1, |n| n.get());
    pool(wanted, std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()))
}

fn pool(processors: usize, asked: Option<usize>) -> Result<()> {
    let wanted = asked.filter(|n| *n > 0).unwrap_or(processors).min(MOST.max(4 * processors));
    let mut failed = None;
    // Each waits for what it is to be in the pool.
    let mut waiting: Vec<Sender<ThreadBuilder>> = Vec::new();
    while waiting.len() < wanted && failed.is_none() {
        let (give, take) = channel::<ThreadBuilder>();
        let (tell, begun) = channel();
        let body = move || {
            let _ = tell.send(());
            if let Ok(thread) = take.recv() {
                thread.run();
            }
        };
        // One by one: a thread takes some memory more when it begins, and cannot do without.
        match std::thread::Builder::new().name(format!("pool {}", waiting.len())).spawn(body) {
            Ok(_) if begun.recv().is_ok() => waiting.push(give),
            Ok(_) => failed = Some(std::io::ErrorKind::OutOfMemory.into()),
            Err(e) => failed = Some(e),
        }
    }
    if failed.is_some() {
        // What the last of them took is needed for the work itself.
        waiting.truncate(waiting.len().div_ceil(2));
    }
    if let (true, Some(e)) = (waiting.is_empty(), failed) {
        return Err(Fault::threads(&e).at(format!("0 of {wanted} threads run, at least 1 is needed")));
    }
    let give = |thread: ThreadBuilder| {
        let place = thread.index();
        waiting[place].send(thread).map_err(|_| std::io::Error::other("a thread of the pool ended"))
    };
    let built = ThreadPoolBuilder::new().num_threads(waiting.len()).spawn_handler(give).build_global();
    built.map_err(|e| Fault::device(format!("the threads cannot be used: {e}")).next("run the same command again"))
}
