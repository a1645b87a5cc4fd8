//! Every relative link of a document leads to a file and, where it names one, to a heading.

use super::markdown::{Markdown, anchor};
use std::collections::BTreeMap;

/// The anchors of a document; a heading that comes again is numbered, as GitHub does.
fn anchors(text: &str) -> Vec<String> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut all = Vec::new();
    for heading in Markdown::read(text).headings {
        let name = anchor(&heading);
        let times = seen.entry(name.clone()).or_default();
        all.push(if *times == 0 { name } else { format!("{name}-{times}") });
        *times += 1;
    }
    all
}

#[test]
fn every_link_leads_somewhere() {
    let mut broken = Vec::new();
    let mut count = 0;
    for (name, text) in super::files(&["md"]) {
        let folder = super::root().join(&name).parent().expect("a file has a folder").to_owned();
        for (line, link) in Markdown::read(&text).links {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (path, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = if path.is_empty() { super::root().join(&name) } else { folder.join(path) };
            if !target.exists() {
                broken.push(format!("{name}:{line}: {link}: there is no such file"));
            } else if !heading.is_empty() {
                let text = std::fs::read_to_string(&target).unwrap_or_default();
                if !anchors(&text).iter().any(|a| a == heading) {
                    broken.push(format!("{name}:{line}: {link}: there is no such heading"));
                }
            }
        }
    }
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
    assert!(count > 100, "only {count} links were read");
}

/// Help, messages and comments name documents by their path.
#[test]
fn every_document_that_the_program_names_exists() {
    let mut broken = Vec::new();
    for (name, text) in super::files(&["rs", "wgsl", "js"]).iter().filter(|(n, _)| !n.starts_with("tests/docs")) {
        for (n, line) in text.lines().enumerate() {
            for (at, _) in line.match_indices("docs/") {
                let path: String =
                    line[at..].chars().take_while(|c| c.is_alphanumeric() || "/-_.".contains(*c)).collect();
                if let Some(end) = path.find(".md") {
                    let path = &path[..end + 3];
                    if !super::root().join(path).exists() {
                        broken.push(format!("{name}:{}: {path}", n + 1));
                    }
                }
            }
        }
    }
    assert!(broken.is_empty(), "documents that do not exist:\n{}", broken.join("\n"));
}
