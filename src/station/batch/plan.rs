//! In: a batch's folder, a manifest, what a batch is made with. Out: the folder, which holds this batch and no other:
//! batch.json, manifest.txt, results/, and work/ for what is under way.
//! Frame and unit: none.

use super::identity::{BatchOptions, FORMAT, Identity};
use super::manifest::{Manifest, line};
use super::rows::BatchRow;
use crate::fault::{Fault, Result};
use crate::files::{Aside, Lock, Workplace};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

const BATCH: &str = "batch.json";
const MANIFEST: &str = "manifest.txt";
const RESULTS: &str = "results";
const WORK: &str = "work";

/// How far a batch is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Planned {
    /// Recordings of the manifest.
    pub recordings: u64,
    /// Those that have results.
    pub with_results: u64,
}

/// A batch's folder.
pub(super) struct Folder<'a> {
    out: &'a Path,
    pub identity: Identity,
}

impl<'a> Folder<'a> {
    /// Makes the folder, or goes on in it.
    ///
    /// # Errors
    /// A folder with another batch, a recording or a station; the disk.
    pub fn plan(manifest: &Manifest, options: &'a BatchOptions) -> Result<Folder<'a>> {
        let out = options.out.as_path();
        for (file, what) in [("meta.json", "a recording"), ("station.toml", "a station"), ("scan.json", "a scan")] {
            if out.join(file).exists() {
                return Err(Fault::usage(format!("{}: is {what}, it has a {file}", out.display()))
                    .cause("the folder of the results was exchanged with another")
                    .next("give the batch a separate folder"));
            }
        }
        let identity = Identity::of(options, manifest.sha256(), manifest.recordings())?;
        crate::files::make_folder(out)?;
        let _lock = Lock::wait(out, "batch")?;
        let folder = Folder { out, identity };
        match read(out)? {
            Some(there) => match folder.identity.differs(&there) {
                None => {}
                Some(how) => {
                    return Err(Fault::usage(format!("{}: contains another batch: {how}", out.display()))
                        .cause("two batches were given one folder, or something was changed since the first run")
                        .next("give this batch another --out"));
                }
            },
            None => folder.begin(manifest)?,
        }
        Workplace::sweep(&folder.work())?;
        Ok(folder)
    }

    /// A folder in which a batch was begun.
    ///
    /// # Errors
    /// A folder without one.
    #[cfg(feature = "tables")]
    pub fn open(out: &'a Path) -> Result<Folder<'a>> {
        let identity = read(out)?.ok_or_else(|| {
            Fault::input(format!("{}: contains no {BATCH}", out.display()))
                .cause("no batch was begun in this folder")
                .next("give the folder that sheetlight batch wrote with --out")
        })?;
        Ok(Folder { out, identity })
    }

    /// The list first: without it a batch.json would be of nothing.
    fn begin(&self, manifest: &Manifest) -> Result<()> {
        let path = self.out.join(MANIFEST);
        let aside = Aside::create(&path)?;
        let mut to = BufWriter::new(aside.file());
        let full = |e| Fault::write(&path, e);
        manifest.each(|entry| to.write_all(line(&entry).as_bytes()).map_err(full))?;
        to.flush().map_err(full)?;
        drop(to);
        aside.keep()?;
        let text = serde_json::to_string_pretty(&self.identity).expect("plain data");
        crate::files::write(&self.out.join(BATCH), text.as_bytes())
    }

    /// Its list.
    #[cfg(feature = "tables")]
    pub fn manifest(&self) -> Result<Manifest> {
        let manifest = Manifest::open(&self.out.join(MANIFEST))?;
        if manifest.sha256() == self.identity.manifest {
            return Ok(manifest);
        }
        Err(Fault::input(format!(
            "{}: has SHA-256 {:.12}, its batch.json says {:.12}",
            self.out.join(MANIFEST).display(),
            manifest.sha256(),
            self.identity.manifest
        ))
        .cause("the copy of the manifest was edited")
        .next("run sheetlight batch with the manifest into another folder"))
    }

    /// Where results of this name are, from the batch's folder on. Two levels, so that a folder of a million of them
    /// can be listed.
    pub fn results(key: &str) -> String {
        format!("{RESULTS}/{}/{key}", &key[..2])
    }

    /// The same as a path.
    pub fn path(&self, key: &str) -> PathBuf {
        self.out.join(Folder::results(key))
    }

    /// An empty folder for results under way.
    pub fn workplace(&self) -> Result<Workplace> {
        Workplace::make(&self.work())
    }

    /// This machine's own: on a network's disk a lock may hold on one machine only, and who sweeps there would take
    /// away what another one works at.
    fn work(&self) -> PathBuf {
        self.out.join(WORK).join(host())
    }

    /// What came of a recording; `None`: nothing yet.
    pub fn row(&self, key: &str) -> Result<Option<BatchRow>> {
        let path = self.path(key).join("result.json");
        let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
        let read: Option<BatchRow> = serde_json::from_str(&text).ok();
        let read = read.filter(|r| r.format == FORMAT && r.result == key);
        read.map(Some).ok_or_else(|| {
            Fault::input(format!("{}: is not the result that its folder's name says", path.display()))
                .cause("it was edited, damaged, or copied from another folder")
                .next("take the folder away and run the batch again: it is made anew")
        })
    }

    /// How many results are there.
    pub fn planned(&self) -> Result<Planned> {
        let mut with_results = 0;
        let names = |path: &Path| std::fs::read_dir(path).into_iter().flatten().flatten();
        for within in names(&self.out.join(RESULTS)) {
            with_results += names(&within.path()).filter(|e| e.file_name().len() == 64).count() as u64;
        }
        Ok(Planned { recordings: self.identity.recordings, with_results })
    }
}

/// What this machine is called, as a folder can be.
fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").or_else(|_| std::env::var("COMPUTERNAME"));
    let name = name.or_else(|_| std::env::var("HOSTNAME")).unwrap_or_default();
    let plain: String = name.trim().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    if plain.is_empty() { "machine".into() } else { plain }
}

fn read(out: &Path) -> Result<Option<Identity>> {
    let path = out.join(BATCH);
    let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|e| {
        Fault::input(format!("{}: is not a batch's: {e}", path.display()))
            .cause("a file of an earlier version, or edited by hand")
            .next("give the batch another --out")
    })
}
