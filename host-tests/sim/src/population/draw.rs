//! Draws of values, and expressions of drawn variables, such as `1000 * modulus_kpa * (1 + modulus_off)`.

use crate::effects::normal_within_3;
use fastrand::Rng;
use serde::Serialize;

#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Drawn {
    Number(f64),
    Word(String),
}

#[derive(Clone, Debug, PartialEq)]
pub enum Draw {
    Always(Drawn),
    Uniform([f64; 2]),
    LogUniform([f64; 2]),
    /// Normal distribution by mean and deviation, drawn again beyond three deviations.
    Normal([f64; 2]),
    /// Choice of a draw by weights.
    Choice(Vec<(f64, Draw)>),
    /// Expression of variables.
    Is(String),
    /// Draw by the value of a variable that is a word.
    By(String, Vec<(String, Draw)>),
    Times(f64, Box<Draw>),
}

impl Draw {
    /// Draws a value. `variable` returns the variables that were drawn before.
    pub fn draw(&self, rng: &mut Rng, variable: &dyn Fn(&str) -> Option<Drawn>) -> Option<Drawn> {
        let number = match self {
            Self::Always(value) => return Some(value.clone()),
            Self::Uniform([low, high]) => low + (high - low) * rng.f64(),
            Self::LogUniform([low, high]) => low * libm::exp(libm::log(high / low) * rng.f64()),
            Self::Normal([mean, deviation]) => mean + deviation * normal_within_3(rng),
            Self::Choice(choices) => {
                let mut left = rng.f64() * choices.iter().map(|(weight, _)| weight).sum::<f64>();
                let chosen = choices.iter().find(|(weight, _)| {
                    left -= weight;
                    left < 0.0
                });
                return chosen.or(choices.last())?.1.draw(rng, variable);
            }
            Self::Is(text) => range(text, &mut |name| Some([variable(name)?.number()?; 2])).ok()?[0],
            Self::By(name, cases) => {
                let value = variable(name)?;
                let case = cases.iter().find(|(case, _)| value == Drawn::Word(case.clone()))?;
                return case.1.draw(rng, variable);
            }
            Self::Times(factor, draw) => factor * draw.draw(rng, variable)?.number()?,
        };
        Some(Drawn::Number(number))
    }

    /// Range of the numbers; none if it draws words.
    pub fn range(&self, variable: &dyn Fn(&str) -> Option<[f64; 2]>) -> Option<[f64; 2]> {
        match self {
            Self::Always(value) => value.number().map(|number| [number; 2]),
            Self::Uniform(ends) | Self::LogUniform(ends) => Some(*ends),
            Self::Normal([mean, deviation]) => Some([mean - 3.0 * deviation, mean + 3.0 * deviation]),
            Self::Is(text) => range(text, &mut |name| variable(name)).ok(),
            Self::Choice(_) | Self::By(..) => {
                let ranges: Option<Vec<[f64; 2]>> = self.parts().into_iter().map(|draw| draw.range(variable)).collect();
                ranges?.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
            }
            Self::Times(factor, draw) => draw.range(variable).map(|[low, high]| [factor * low, factor * high]),
        }
    }

    fn parts(&self) -> Vec<&Self> {
        match self {
            Self::Choice(choices) => choices.iter().map(|(_, draw)| draw).collect(),
            Self::By(_, cases) => cases.iter().map(|(_, draw)| draw).collect(),
            Self::Times(_, draw) => vec![draw],
            _ => Vec::new(),
        }
    }

    /// Possible final draws: constants, and draws of numbers.
    pub fn ends(&self) -> Vec<&Self> {
        let parts = self.parts();
        if parts.is_empty() { vec![self] } else { parts.into_iter().flat_map(Self::ends).collect() }
    }

    pub fn words(&self) -> Vec<&str> {
        let word = |end| if let &Self::Always(Drawn::Word(ref word)) = end { Some(word.as_str()) } else { None };
        self.ends().into_iter().filter_map(word).collect()
    }

    pub fn uses(&self) -> Vec<&str> {
        let own = match self {
            Self::By(name, _) => vec![name.as_str()],
            Self::Is(text) => variables(text),
            _ => Vec::new(),
        };
        own.into_iter().chain(self.parts().into_iter().flat_map(Self::uses)).collect()
    }
}

impl Drawn {
    pub fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self { Some(*number) } else { None }
    }

    /// Rounds to six significant digits, or to a whole number: what people read, and enough for a draw.
    pub fn rounded(self, whole: bool) -> Self {
        match self {
            Self::Number(number) if whole => Self::Number((number + 0.5).floor()),
            Self::Number(number) => Self::Number(format!("{number:.5e}").parse().unwrap_or(number) + 0.0),
            word => word,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    pub count: usize,
    pub median: Option<f64>,
    #[serde(rename = "percentile_95")]
    pub most: Option<f64>,
    pub worst: Option<f64>,
}

impl Spread {
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| values.get(((values.len() as f64 * share).ceil() as usize).max(1) - 1).copied();
        Self { count: values.len(), median: rank(0.5), most: rank(0.95), worst: values.last().copied() }
    }
}

/// Range of an expression for the ranges of its variables. A number is a range without a width. Correlations between two
/// terms are ignored.
///
/// # Errors
/// The text is no expression, or `variable` has no range for a name.
pub fn range<'a>(text: &'a str, variable: &mut dyn FnMut(&'a str) -> Option<[f64; 2]>) -> Result<[f64; 2], String> {
    let mut parser = Parser { rest: text, variable };
    let range = parser.sum()?;
    match parser.rest.trim() {
        "" => Ok(range),
        rest => Err(format!("`{rest}` is not understood")),
    }
}

pub fn variables(text: &str) -> Vec<&str> {
    let mut names = Vec::new();
    let _ = range(text, &mut |name| {
        names.push(name);
        Some([1.0; 2])
    });
    names
}

struct Parser<'a, 'v> {
    rest: &'a str,
    variable: &'v mut dyn FnMut(&'a str) -> Option<[f64; 2]>,
}

impl Parser<'_, '_> {
    fn sum(&mut self) -> Result<[f64; 2], String> {
        self.chain(['+', '-'], Self::product)
    }

    fn product(&mut self) -> Result<[f64; 2], String> {
        self.chain(['*', '/'], Self::term)
    }

    /// Parses terms with operators of the same rank between them, from the left.
    fn chain(&mut self, signs: [char; 2], part: fn(&mut Self) -> Result<[f64; 2], String>) -> Result<[f64; 2], String> {
        let mut all = part(self)?;
        loop {
            self.rest = self.rest.trim_start();
            let Some(sign) = signs.into_iter().find(|sign| self.rest.starts_with(*sign)) else {
                return Ok(all);
            };
            self.rest = &self.rest[1..];
            all = apply(sign, all, part(self)?);
        }
    }

    fn term(&mut self) -> Result<[f64; 2], String> {
        self.rest = self.rest.trim_start();
        if let Some(inner) = self.rest.strip_prefix('(') {
            self.rest = inner;
            let inside = self.sum()?;
            self.rest = self.rest.trim_start().strip_prefix(')').ok_or("a `)` is missing")?;
            return Ok(inside);
        }
        let end = |c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '.');
        let (word, after) = self.rest.split_at(self.rest.find(end).unwrap_or(self.rest.len()));
        self.rest = after;
        match word.chars().next() {
            Some(first) if first.is_ascii_digit() => {
                word.parse().map(|number| [number; 2]).map_err(|_| format!("`{word}` is no number"))
            }
            Some(first) if first.is_ascii_alphabetic() => {
                (self.variable)(word).ok_or_else(|| format!("`{word}` is unknown"))
            }
            _ => Err(format!("a number or a variable is missing before `{}`", after.trim())),
        }
    }
}

fn apply(sign: char, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let of: fn(f64, f64) -> f64 = match sign {
        '+' => |a, b| a + b,
        '-' => |a, b| a - b,
        '*' => |a, b| a * b,
        _ if b[0] <= 0.0 && b[1] >= 0.0 => return [f64::NEG_INFINITY, f64::INFINITY],
        _ => |a, b| a / b,
    };
    let all = [of(a[0], b[0]), of(a[0], b[1]), of(a[1], b[0]), of(a[1], b[1])];
    [all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Option<f64> {
        let known = [("a", 3.0), ("b_mm", 0.5)];
        let variable = |name: &str| known.into_iter().find(|(n, _)| *n == name).map(|(_, value)| [value; 2]);
        range(text, &mut |name| variable(name)).ok().map(|[value, _]| value)
    }

    #[test]
    fn products_come_before_sums_and_all_goes_from_the_left() {
        assert_eq!(value("1 + 2 * a - 4 / 2 / 2"), Some(6.0));
        assert_eq!(value(" 10 * (1 + b_mm)*a "), Some(45.0));
        assert_eq!(value("a - b_mm - 1"), Some(1.5));
        for wrong in ["a * c", "", "1 +", "(1", "1)", "1 a", "* 2", "1.2.3", "-1"] {
            assert_eq!(value(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn the_range_holds_every_value() {
        let range = |text: &'static str| range(text, &mut |_| Some([-1.0, 2.0])).ok();
        assert_eq!(range("3 * a + 1"), Some([-2.0, 7.0]));
        assert_eq!(range("a * a"), Some([-2.0, 4.0]));
        assert_eq!(range("1 - a"), Some([-1.0, 2.0]));
        assert_eq!(range("1 / a"), Some([f64::NEG_INFINITY, f64::INFINITY]));
        assert_eq!(range("1 / (a + 2)"), Some([0.25, 1.0]));
    }
}
