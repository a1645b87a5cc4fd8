//! In: this machine's processors and the limits of the process. Out: the thread pool for all parallel work.
//! Frame and unit: none.

use rayon::{ThreadBuilder, ThreadPoolBuilder};
use sheetlight::fault::{Fault, Result};
use std::sync::mpsc::{Sender, channel};

/// Requested numbers of threads above this, and above four per processor, are taken as a mistake and reduced. A
/// thread without memory for its signal stack crashes the whole process.
const MOST: usize = 256;

/// Starts one thread per processor, or as many as the process can get. rayon's own start either gets all threads or
/// panics at its first use, and cannot be repeated.
pub fn start() -> Result<()> {
    let wanted = std::thread::available_parallelism().map_or(1, |n| n.get());
    pool(wanted, std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()))
}

fn pool(processors: usize, asked: Option<usize>) -> Result<()> {
    let wanted = asked.filter(|n| *n > 0).unwrap_or(processors).min(MOST.max(4 * processors));
    let mut failed = None;
    // Each thread waits for its role in the pool.
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
        // Threads are started one by one, because each allocates some more memory at its start that it cannot run
        // without.
        match std::thread::Builder::new().name(format!("pool {}", waiting.len())).spawn(body) {
            Ok(_) if begun.recv().is_ok() => waiting.push(give),
            Ok(_) => failed = Some(std::io::ErrorKind::OutOfMemory.into()),
            Err(e) => failed = Some(e),
        }
    }
    if failed.is_some() {
        // Some threads are given up, because the work itself needs their memory.
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
