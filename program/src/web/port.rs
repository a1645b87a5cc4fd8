//! In: an address and a port. Out: a listener on it, or on the next free port; the name of the program that uses
//! the requested one.
//! Frame and unit: none.

use sheetlight::fault::{Fault, Result};
use std::net::IpAddr;
use std::path::Path;
use tokio::net::TcpListener;

/// Most ports that are tried after the requested one.
const TRIES: u16 = 20;

/// A listener, and if its port is not the requested one, a sentence that says why.
///
/// # Errors
/// None of the ports is available.
pub(super) async fn listen(address: IpAddr, asked: u16, next_free: bool) -> Result<(TcpListener, Option<String>)> {
    let most = if next_free && asked > 0 { TRIES } else { 1 };
    let mut failed = None;
    for port in (0..most).map_while(|k| asked.checked_add(k)) {
        match TcpListener::bind((address, port)).await {
            Ok(listener) => {
                let instead =
                    failed.map(|_| format!("port {asked} is taken{}; {port} is the next free one", by(asked)));
                return Ok((listener, instead));
            }
            Err(e) => failed = failed.or(Some(e)),
        }
    }
    let why = failed.map_or_else(|| "no port".into(), |e| e.to_string());
    let by = by(asked);
    Err(Fault::device(format!("{address}:{asked} cannot be listened on: {why}{by}"))
        .cause("another program has the port, or the address is not this machine's")
        .next("choose another --port; 0 takes any that is free"))
}

/// Which program uses a port, if this machine reveals it; programs of other users are not named.
fn by(port: u16) -> String {
    holder(port, Path::new("/proc")).map_or_else(String::new, |who| format!(" by {who}"))
}

/// Name and number of the process that listens on a port, from Linux's /proc.
fn holder(port: u16, proc: &Path) -> Option<String> {
    let socket = |inode: &str| format!("socket:[{inode}]");
    let sockets: Vec<String> = ["net/tcp", "net/tcp6"]
        .iter()
        .filter_map(|table| sheetlight::files::read_text(&proc.join(table)).ok())
        .flat_map(|table| table.lines().filter_map(|l| listening(l, port)).map(socket).collect::<Vec<_>>())
        .collect();
    let processes = std::fs::read_dir(proc).ok()?.flatten();
    let has = |folder: &Path| {
        let open = std::fs::read_dir(folder.join("fd")).into_iter().flatten().flatten();
        open.filter_map(|fd| std::fs::read_link(fd.path()).ok())
            .any(|to| sockets.iter().any(|s| to.as_os_str() == s.as_str()))
    };
    let numbered = processes.filter_map(|e| Some((e.file_name().to_str()?.parse::<u32>().ok()?, e.path())));
    let (number, folder) = numbered.into_iter().find(|(_, folder)| !sockets.is_empty() && has(folder))?;
    let name = sheetlight::files::read_text(&folder.join("comm")).unwrap_or_default();
    Some(format!("{} (process {number})", name.trim()))
}

/// The inode of a line of net/tcp if its socket listens on this port.
fn listening(line: &str, port: u16) -> Option<&str> {
    const LISTENS: &str = "0A";
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, local, _, state, _, _, _, _, _, inode, ..] = words[..] else { return None };
    let at = u16::from_str_radix(local.rsplit_once(':')?.1, 16).ok()?;
    (state == LISTENS && at == port).then_some(inode)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn who_listens_on_a_port_is_named() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let who = holder(port, Path::new("/proc")).unwrap();
        assert!(who.contains(&format!("(process {})", std::process::id())), "{who}");
        drop(listener);
        assert_eq!(holder(port, Path::new("/proc")), None);
        assert_eq!(holder(port, Path::new("/none")), None);
    }
}
