//! Markdown as these checks need it: prose without its marks, fenced blocks, headings, links.

pub struct Prose {
    pub line: usize,
    pub text: String,
}

pub struct Fence {
    pub line: usize,
    /// What stands behind the three backquotes.
    pub info: String,
    /// How far a block within a list is indented.
    indent: usize,
    pub lines: Vec<String>,
}

pub struct Markdown {
    /// Paragraphs, list items, headings and cells of tables, each on its own. Code is the word CODE.
    pub prose: Vec<Prose>,
    pub fences: Vec<Fence>,
    pub headings: Vec<String>,
    /// Lines that are indented as code, outside lists.
    pub indented: Vec<(usize, String)>,
    /// Targets of links and pictures, with their line.
    pub links: Vec<(usize, String)>,
}

/// The text without code, links' targets and emphasis.
fn plain(text: &str, line: usize, links: &mut Vec<(usize, String)>) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if c == '`' || c == '$' {
            let marks = rest.chars().take_while(|x| *x == c).count();
            let mark = &rest[..marks];
            if let Some(end) = rest[marks..].find(mark) {
                out.push_str("CODE");
                rest = &rest[2 * marks + end..];
                continue;
            }
        }
        if let Some(inner) = rest.strip_prefix("](")
            && let Some(end) = inner.find(')')
        {
            links.push((line, inner[..end].to_owned()));
            rest = &inner[end + 1..];
            continue;
        }
        if !matches!(c, '[' | ']' | '*' | '_') {
            out.push(c);
        }
        rest = &rest[c.len_utf8()..];
    }
    out
}

/// The text behind a list's mark, if the line begins an item.
fn item(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let digits = line.chars().take_while(char::is_ascii_digit).count();
    let numbered = (digits > 0).then(|| line[digits..].strip_prefix(". ")).flatten();
    line.strip_prefix("- ").or_else(|| line.strip_prefix("* ")).or(numbered)
}

impl Markdown {
    pub fn read(text: &str) -> Self {
        let mut all = Self {
            prose: Vec::new(),
            fences: Vec::new(),
            headings: Vec::new(),
            indented: Vec::new(),
            links: Vec::new(),
        };
        let mut fence: Option<Fence> = None;
        let mut open: Option<(usize, String)> = None;
        let mut in_list = false;
        for (n, line) in text.lines().enumerate().map(|(i, l)| (i + 1, l)) {
            if let Some(mut block) = fence.take() {
                if line.trim_start().starts_with("```") {
                    all.fences.push(block);
                } else {
                    let blanks = line.len() - line.trim_start().len();
                    block.lines.push(line[blanks.min(block.indent)..].to_owned());
                    fence = Some(block);
                }
                continue;
            }
            if let Some(info) = line.trim_start().strip_prefix("```") {
                all.end(&mut open);
                in_list &= line.starts_with(' ');
                let indent = line.len() - line.trim_start().len();
                fence = Some(Fence { line: n, info: info.trim().to_owned(), indent, lines: Vec::new() });
            } else if line.trim().is_empty() {
                all.end(&mut open);
            } else if line.starts_with("    ") && open.is_none() && (!in_list || line.starts_with("      ")) {
                all.indented.push((n, line.trim().to_owned()));
            } else if let Some(heading) = line.strip_prefix('#') {
                all.end(&mut open);
                in_list = false;
                let heading = heading.trim_start_matches('#').trim();
                all.headings.push(heading.to_owned());
                open = Some((n, heading.to_owned()));
                all.end(&mut open);
            } else if let Some((_, target)) = line.split_once("]: ").filter(|(name, _)| name.starts_with('[')) {
                all.end(&mut open);
                all.links.push((n, target.to_owned()));
            } else if line.starts_with('|') {
                all.end(&mut open);
                for cell in line.replace("\\|", "/").split('|').filter(|c| c.chars().any(char::is_alphanumeric)) {
                    open = Some((n, cell.trim().to_owned()));
                    all.end(&mut open);
                }
            } else if let Some(words) = item(line) {
                all.end(&mut open);
                in_list = true;
                open = Some((n, words.to_owned()));
            } else {
                in_list &= line.starts_with(' ') || open.is_some();
                let words = line.trim().trim_start_matches("> ");
                match &mut open {
                    Some((_, text)) => *text = format!("{text} {words}"),
                    None => open = Some((n, words.to_owned())),
                }
            }
        }
        all.end(&mut open);
        all
    }

    fn end(&mut self, open: &mut Option<(usize, String)>) {
        if let Some((line, text)) = open.take() {
            let text = plain(&text, line, &mut self.links);
            self.prose.push(Prose { line, text });
        }
    }
}

/// The anchor that GitHub gives a heading.
pub fn anchor(heading: &str) -> String {
    let kept = heading.to_lowercase().replace('`', "");
    kept.chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// The sentences of a text. A full stop ends one where a capital, a digit, a bracket or code follows.
pub fn sentences(text: &str) -> Vec<String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut all = vec![Vec::new()];
    for (i, word) in words.iter().enumerate() {
        all.last_mut().expect("begins with one").push(*word);
        let bare = word.trim_end_matches([')', '"', '\'', '”']);
        let short = ["e.g.", "i.e.", "cf.", "vs.", "No."].contains(&bare.trim_start_matches('('));
        let next = words.get(i + 1).and_then(|w| w.chars().next());
        let begins = next.is_none_or(|c| c.is_uppercase() || c.is_ascii_digit() || "(\"'“".contains(c));
        if bare.ends_with(['.', '!', '?']) && !short && begins {
            all.push(Vec::new());
        }
    }
    all.retain(|s| !s.is_empty());
    all.iter().map(|s| s.join(" ")).collect()
}

pub fn words(sentence: &str) -> usize {
    sentence.split_whitespace().filter(|w| w.chars().any(char::is_alphanumeric)).count()
}

#[test]
fn prose_is_told_from_code_and_sentences_from_each_other() {
    let text = "# A *head*\n\nOne `x. Y` two. Three [four](five.md#six),\nseven.\n\n- eight. Nine\n  ten\n\n\
                ```console\n$ run\nout\n```\n\n    $ old\n\n| a. B | c |\n|---|---|\n\n[k]: l.md\n";
    let read = Markdown::read(text);
    let prose: Vec<&str> = read.prose.iter().map(|p| p.text.as_str()).collect();
    assert_eq!(prose, ["A head", "One CODE two. Three four, seven.", "eight. Nine ten", "a. B", "c"]);
    assert_eq!(sentences(prose[1]), ["One CODE two.", "Three four, seven."]);
    assert_eq!(read.links, [(3, "five.md#six".to_owned()), (19, "l.md".to_owned())]);
    assert_eq!((read.fences[0].info.as_str(), read.fences[0].lines.len()), ("console", 2));
    assert_eq!(read.indented, [(14, "$ old".to_owned())]);
    assert_eq!(anchor("What `--pair` says, and why"), "what---pair-says-and-why");
}
