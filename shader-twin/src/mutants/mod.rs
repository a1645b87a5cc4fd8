//! In: a shader that passes its cases. Out: which changes of it the cases notice.

mod changes;
mod judge;
mod loops;
mod templates;
mod tokens;

pub(crate) use judge::{Trial, judged};

/// A change that the cases did not notice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mutant {
    /// Line of the shader, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The text that is changed.
    pub original: String,
    /// What it becomes; empty where a sign before a value is taken away.
    pub mutated: String,
    /// The line before, without blanks at both ends.
    pub was: String,
    /// The line after.
    pub now: String,
}

/// Why a mutant computes the same as the shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Explained {
    /// The line of the shader that it changes, without blanks at both ends.
    pub was: String,
    /// The line after the change.
    pub now: String,
    /// Why no case can notice it.
    pub reason: String,
}

/// What the mutants of a stage gave.
///
/// One place is changed at a time: arithmetic, bit, logical and comparison operators, `++` and `--`, the signs `-`,
/// `!` and `~` before a value, literals, and `min`/`max`, `floor`/`ceil`. Attributes, template lists and `const_assert`
/// stay: the contract compares those. A change that naga or the device refuses is no mutant, and neither is one that
/// gives the same program, such as the default of an override constant that every case sets.
///
/// A mutant may loop without end. Every loop of a mutant gets a counter: an invocation leaves all its loops once it
/// has taken [`Mutants::turns`] turns in all of them together, which is at least four times what the shader itself
/// needs. A device that does not answer within the time limit is given up and opened anew; the mutant counts as
/// noticed. Its dispatch may keep a processor busy until the program ends, and SwiftShader runs nothing else until the
/// dispatch ends.
#[derive(Clone, Debug, Default)]
pub struct Mutants {
    /// A case differed from the twin.
    pub killed: usize,
    /// No end within the time limit, or the device was lost. Counts as noticed.
    pub timed_out: usize,
    /// naga or the device refused the changed text.
    pub refused: usize,
    /// The changed text is the same program.
    pub same_program: usize,
    /// No case noticed these, and nobody explained them.
    pub survivors: Vec<Mutant>,
    /// No case noticed these, and the reason is given.
    pub explained: Vec<(Mutant, String)>,
    /// Explanations that no survivor needs, or that have no reason.
    pub stale: Vec<String>,
    /// Turns of all loops that one invocation of a mutant may take; 0 where the shader has no loop.
    pub turns: u32,
}

impl Mutants {
    /// Mutants that ran.
    pub fn total(&self) -> usize {
        self.killed + self.timed_out + self.survivors.len() + self.explained.len()
    }

    /// Every mutant was noticed or is explained, and every explanation is needed.
    pub fn passed(&self) -> bool {
        self.total() > 0 && self.survivors.is_empty() && self.stale.is_empty()
    }

    /// One line of counts.
    pub fn line(&self) -> String {
        format!(
            "{} mutants: {} killed, {} timed out, {} explained, {} survived; not run: {} refused, {} the same program",
            self.total(),
            self.killed,
            self.timed_out,
            self.explained.len(),
            self.survivors.len(),
            self.refused,
            self.same_program
        )
    }

    /// Sorts a change that no case noticed: explained or survivor.
    fn survived(&mut self, mutant: Mutant, explained: &[Explained]) {
        match explained.iter().find(|e| e.was == mutant.was && e.now == mutant.now) {
            Some(e) => self.explained.push((mutant, e.reason.clone())),
            None => self.survivors.push(mutant),
        }
    }

    /// Finds explanations that are not needed.
    fn close(&mut self, explained: &[Explained]) {
        let needed = |e: &Explained| self.explained.iter().any(|(m, _)| m.was == e.was && m.now == e.now);
        let stale = explained.iter().filter(|e| !needed(e) || e.reason.trim().is_empty());
        self.stale = stale.map(|e| format!("'{}' -> '{}': {}", e.was, e.now, e.reason)).collect();
    }
}

impl Mutant {
    /// One line: place, change, and the line after it.
    pub fn line(&self) -> String {
        let (line, column) = (self.line, self.column);
        format!("line {line}, column {column}: '{}' -> '{}': {}", self.original, self.mutated, self.now)
    }

    fn of(text: &str, change: &changes::Change) -> Mutant {
        let begin = text[..change.at.start].rfind('\n').map_or(0, |at| at + 1);
        let end = text[change.at.end..].find('\n').map_or(text.len(), |at| change.at.end + at);
        let now = format!("{}{}{}", &text[begin..change.at.start], change.now, &text[change.at.end..end]);
        Mutant {
            line: text[..begin].matches('\n').count() + 1,
            column: text[begin..change.at.start].chars().count() + 1,
            original: text[change.at.clone()].into(),
            mutated: change.now.clone(),
            was: text[begin..end].trim().into(),
            now: now.trim().into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn explained(now: &str, reason: &str) -> Explained {
        Explained { was: "b = 1 < c; // ö".into(), now: now.into(), reason: reason.into() }
    }

    fn mutant() -> Mutant {
        let text = "a;\n  b = 1 < c; // ö\nd;";
        Mutant::of(text, &changes::changes(text)[2])
    }

    #[test]
    fn a_mutant_knows_its_line_and_column() {
        let m = mutant();
        assert_eq!((m.line, m.column, m.original.as_str(), m.mutated.as_str()), (2, 9, "<", "<="));
        assert_eq!((m.was.as_str(), m.now.as_str()), ("b = 1 < c; // ö", "b = 1 <= c; // ö"));
    }

    #[test]
    fn explanations_are_used_and_those_without_need_or_reason_are_refused() {
        let list = [explained("b = 1 <= c; // ö", "c is never 1"), explained("b = 1 >= c; // ö", "old")];
        let mut found = Mutants::default();
        found.survived(mutant(), &list);
        found.close(&list);
        assert_eq!((found.survivors.len(), found.explained.len(), found.stale.len()), (0, 1, 1));
        assert!(found.stale[0].ends_with("old") && !found.passed());
        let list = [explained("b = 1 <= c; // ö", " ")];
        found.close(&list);
        assert_eq!(found.stale.len(), 1);
        found.close(&[]);
        assert!(found.passed());
        found.survived(mutant(), &[]);
        assert!(!found.passed());
    }

    #[test]
    fn no_mutant_is_no_proof() {
        assert!(!Mutants::default().passed());
    }
}
