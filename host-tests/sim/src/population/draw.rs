//! Draws of values, and expressions of drawn variables, such as `1000 * modulus_kpa * (1 + modulus_off)`.

use crate::effects::normal_within_3;
use fastrand::Rng;
use serde::Serialize;
use serde_json::{Value, json};

/// Drawn value.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Drawn {
    /// A number.
    Number(f64),
    /// A word of a choice.
    Word(String),
}

#[derive(Clone, Debug, PartialEq)]
pub enum Draw {
    /// Constant.
    Always(Drawn),
    /// Uniform distribution between two values.
    Uniform([f64; 2]),
    /// Log-uniform distribution between two values.
    LogUniform([f64; 2]),
    /// Normal distribution by mean and deviation, drawn again beyond three deviations.
    Normal([f64; 2]),
    /// Choice of a draw by weights.
    Choice(Vec<(f64, Draw)>),
    /// Expression of variables.
    Is(Expression),
    /// Draw by the value of a variable that is a word; the last one for any other word.
    By(String, Vec<(String, Draw)>, Option<Box<Draw>>),
    /// Draw, multiplied by a factor.
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
            Self::Is(expression) => expression.value(&|name| variable(name)?.number())?,
            Self::By(name, cases, otherwise) => {
                let Drawn::Word(word) = variable(name)? else { return None };
                let case = cases.iter().find(|(case, _)| *case == word).map(|(_, draw)| draw);
                return case.or(otherwise.as_deref())?.draw(rng, variable);
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
            Self::Choice(choices) => around(choices.iter().map(|(_, draw)| draw), variable),
            Self::Is(expression) => expression.range(variable),
            Self::By(_, cases, otherwise) => {
                around(cases.iter().map(|(_, draw)| draw).chain(otherwise.as_deref()), variable)
            }
            Self::Times(factor, draw) => draw.range(variable).map(|[low, high]| [factor * low, factor * high]),
        }
    }

    /// Possible final draws: constants, and draws of numbers.
    pub fn ends(&self) -> Vec<&Self> {
        match self {
            Self::Choice(choices) => choices.iter().flat_map(|(_, draw)| draw.ends()).collect(),
            Self::By(_, cases, otherwise) => {
                cases.iter().map(|(_, draw)| draw).chain(otherwise.as_deref()).flat_map(Self::ends).collect()
            }
            Self::Times(_, draw) => draw.ends(),
            end => vec![end],
        }
    }

    /// Words that it may draw.
    pub fn words(&self) -> Vec<&str> {
        let word = |end| if let &Self::Always(Drawn::Word(ref word)) = end { Some(word.as_str()) } else { None };
        self.ends().into_iter().filter_map(word).collect()
    }

    /// Variables that it uses.
    pub fn uses(&self) -> Vec<&str> {
        match self {
            Self::Choice(choices) => choices.iter().flat_map(|(_, draw)| draw.uses()).collect(),
            Self::By(name, cases, otherwise) => {
                let draws = cases.iter().map(|(_, draw)| draw).chain(otherwise.as_deref());
                core::iter::once(name.as_str()).chain(draws.flat_map(Self::uses)).collect()
            }
            Self::Times(_, draw) => draw.uses(),
            Self::Is(expression) => expression.variables(),
            _ => Vec::new(),
        }
    }
}

fn around<'a>(draws: impl Iterator<Item = &'a Draw>, variable: &dyn Fn(&str) -> Option<[f64; 2]>) -> Option<[f64; 2]> {
    let ranges: Option<Vec<[f64; 2]>> = draws.map(|draw| draw.range(variable)).collect();
    ranges?.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

impl Drawn {
    /// Number, if it is one.
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

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    pub count: usize,
    pub median: Option<f64>,
    /// 95th percentile.
    pub most: Option<f64>,
    /// Largest value.
    pub worst: Option<f64>,
}

impl Spread {
    /// Spread of values in any order.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| values.get(((values.len() as f64 * share).ceil() as usize).max(1) - 1).copied();
        Self { count: values.len(), median: rank(0.5), most: rank(0.95), worst: values.last().copied() }
    }

    /// Returns the spread for scripts.
    pub fn json(&self) -> Value {
        json!({ "count": self.count, "median": self.median, "percentile_95": self.most, "worst": self.worst })
    }
}

/// Parsed expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    Number(f64),
    /// A drawn variable.
    Variable(String),
    Two(Box<Expression>, Operator, Box<Expression>),
}

/// Operator between two expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// a + b
    Add,
    /// a - b
    Subtract,
    /// a * b
    Multiply,
    /// a / b
    Divide,
}

impl Operator {
    fn of(letter: u8) -> Option<Self> {
        Some(match letter {
            b'+' => Self::Add,
            b'-' => Self::Subtract,
            b'*' => Self::Multiply,
            b'/' => Self::Divide,
            _ => return None,
        })
    }

    fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
        }
    }
}

impl Expression {
    /// Parses an expression.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut rest = text;
        let read = sum(&mut rest)?;
        if rest.trim().is_empty() { Ok(read) } else { Err(format!("`{}` is not understood", rest.trim())) }
    }

    pub fn variables(&self) -> Vec<&str> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Variable(name) => vec![name],
            Self::Two(a, _, b) => [a.variables(), b.variables()].concat(),
        }
    }

    /// Value, if every variable has one.
    pub fn value(&self, variable: &dyn Fn(&str) -> Option<f64>) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Variable(name) => variable(name),
            Self::Two(a, operator, b) => Some(operator.apply(a.value(variable)?, b.value(variable)?)),
        }
    }

    /// Range of the value, if every variable has a range. Correlations between two terms are ignored.
    pub fn range(&self, variable: &dyn Fn(&str) -> Option<[f64; 2]>) -> Option<[f64; 2]> {
        match self {
            Self::Number(number) => Some([*number; 2]),
            Self::Variable(name) => variable(name),
            Self::Two(a, operator, b) => {
                let (a, b) = (a.range(variable)?, b.range(variable)?);
                if *operator == Operator::Divide && b[0] <= 0.0 && b[1] >= 0.0 {
                    return Some([f64::NEG_INFINITY, f64::INFINITY]);
                }
                let all = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| operator.apply(a[i], b[j]));
                Some([all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max)])
            }
        }
    }
}

fn sum(rest: &mut &str) -> Result<Expression, String> {
    chain(rest, b"+-", product)
}

fn product(rest: &mut &str) -> Result<Expression, String> {
    chain(rest, b"*/", term)
}

/// Parses terms with operators of the same rank between them, from the left.
fn chain(
    rest: &mut &str,
    operators: &[u8],
    part: fn(&mut &str) -> Result<Expression, String>,
) -> Result<Expression, String> {
    let mut all = part(rest)?;
    loop {
        *rest = rest.trim_start();
        let Some(letter) = rest.bytes().next().filter(|letter| operators.contains(letter)) else { return Ok(all) };
        let Some(operator) = Operator::of(letter) else { return Ok(all) };
        *rest = &rest[1..];
        all = Expression::Two(Box::new(all), operator, Box::new(part(rest)?));
    }
}

fn term(rest: &mut &str) -> Result<Expression, String> {
    *rest = rest.trim_start();
    if let Some(inner) = rest.strip_prefix('(') {
        *rest = inner;
        let inside = sum(rest)?;
        *rest = rest.trim_start().strip_prefix(')').ok_or("a `)` is missing")?;
        return Ok(inside);
    }
    let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len());
    let (word, after) = rest.split_at(end);
    *rest = after;
    match word.chars().next() {
        Some(first) if first.is_ascii_digit() => {
            word.parse().map(Expression::Number).map_err(|_| format!("`{word}` is no number"))
        }
        Some(first) if first.is_ascii_alphabetic() => Ok(Expression::Variable(word.into())),
        _ => Err(format!("a number or a variable is missing before `{}`", after.trim())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<Option<f64>, String> {
        let variable = |name: &str| [("a", 3.0), ("b_mm", 0.5)].into_iter().find(|(n, _)| *n == name).map(|(_, v)| v);
        Expression::read(text).map(|expression| expression.value(&variable))
    }

    #[test]
    fn products_come_before_sums_and_all_goes_from_the_left() {
        assert_eq!(value("1 + 2 * a - 4 / 2 / 2"), Ok(Some(6.0)));
        assert_eq!(value(" 10 * (1 + b_mm)*a "), Ok(Some(45.0)));
        assert_eq!(value("a - b_mm - 1"), Ok(Some(1.5)));
        assert_eq!(value("a * c"), Ok(None));
        for wrong in ["", "1 +", "(1", "1)", "1 a", "* 2", "1.2.3", "-1"] {
            assert!(value(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_range_holds_every_value() {
        let range = |text: &str| Expression::read(text).ok()?.range(&|_| Some([-1.0, 2.0]));
        assert_eq!(range("3 * a + 1"), Some([-2.0, 7.0]));
        assert_eq!(range("a * a"), Some([-2.0, 4.0]));
        assert_eq!(range("1 - a"), Some([-1.0, 2.0]));
        assert_eq!(range("1 / a"), Some([f64::NEG_INFINITY, f64::INFINITY]));
        assert_eq!(range("1 / (a + 2)"), Some([0.25, 1.0]));
    }
}
