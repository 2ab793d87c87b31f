//! What is wrong with a scene's text, and where.

use std::fmt;
use std::ops::Range;

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// The file as it was named.
    pub file: String,
    /// From 1.
    pub line: usize,
    /// From 1, in characters.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// What is allowed instead.
    pub allowed: String,
    /// What was meant, perhaps.
    pub suggestion: Option<String>,
    /// The line that holds it.
    pub source_line: String,
    /// How many of its characters are meant.
    pub width: usize,
}

impl SceneError {
    /// An error at a range of bytes of a text.
    pub fn new(file: &str, text: &str, at: Range<usize>, message: String, allowed: String) -> Self {
        let start = (0..=at.start.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let source_line = text[line_start..].lines().next().unwrap_or("");
        let column = text[line_start..start].chars().count() + 1;
        let meant = text.get(start..at.end).and_then(|meant| meant.lines().next()).unwrap_or("");
        Self {
            file: file.into(),
            line: text[..line_start].matches('\n').count() + 1,
            column,
            message,
            allowed,
            suggestion: None,
            source_line: source_line.into(),
            width: meant.chars().count().max(1),
        }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, message, allowed, source_line, .. } = self;
        writeln!(f, "{file}:{line}:{column}: {message}")?;
        let number = line.to_string();
        let margin = " ".repeat(number.len());
        // Tabs stay tabs, so that the marks stand below what they mean.
        let before: String = source_line.chars().take(column - 1).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        writeln!(f, "  {number} | {source_line}")?;
        write!(f, "  {margin} | {before}{}", "^".repeat(self.width))?;
        if !allowed.is_empty() {
            write!(f, "\n  allowed: {allowed}")?;
        }
        if let Some(suggestion) = &self.suggestion {
            write!(f, "\n  did you mean `{suggestion}`?")?;
        }
        Ok(())
    }
}

/// Everything that is wrong, in the order of the text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneErrors(pub Vec<SceneError>);

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, error) in self.0.iter().enumerate() {
            if place > 0 {
                f.write_str("\n\n")?;
            }
            error.fmt(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneErrors {}

/// The word that was meant, perhaps: one that lacks or mistakes only its unit, else the most alike.
pub fn alike<'a>(given: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let stem = |word: &str| word.rsplit_once('_').map_or(word.to_owned(), |(stem, _)| stem.to_owned());
    let score = |word: &str| {
        if stem(word) == given || (given.contains('_') && stem(word) == stem(given)) {
            2.0
        } else {
            strsim::jaro_winkler(given, word)
        }
    };
    let best = words.into_iter().map(|word| (score(word), word)).max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (best.0 > 0.8).then_some(best.1)
}
