//! No line is longer than 120 characters.

const MOST: usize = 120;

#[test]
fn no_line_is_longer_than_120_characters() {
    let mut long = Vec::new();
    for (name, text) in super::files(&["md", "rs", "wgsl", "js"]) {
        let over = text.lines().enumerate().filter(|(_, line)| line.chars().count() > MOST);
        long.extend(over.map(|(i, line)| format!("{name}:{}: {} characters", i + 1, line.chars().count())));
    }
    assert!(long.is_empty(), "\n{}", long.join("\n"));
}
