//! How a value is drawn.

use super::expression::Expression;
use crate::effects::normal_within_3;
use fastrand::Rng;
use serde::Serialize;
use serde_json::{Value, json};

/// A drawn value.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Drawn {
    /// A number.
    Number(f64),
    /// A word, of a choice.
    Word(String),
}

/// How a value is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Draw {
    /// Not at all.
    Always(Drawn),
    /// Every value between two is as likely.
    Uniform([f64; 2]),
    /// Every ratio between two is as likely: as many from 1 to 2 as from 2 to 4.
    LogUniform([f64; 2]),
    /// Mean and deviation; drawn again beyond three deviations.
    Normal([f64; 2]),
    /// One of these, each with its weight.
    Choice(Vec<(f64, Draw)>),
    /// Worked out of variables.
    Is(Expression),
    /// As a variable that is a word says; the last where it is none of those.
    By(String, Vec<(String, Draw)>, Option<Box<Draw>>),
    /// Another, times this.
    Times(f64, Box<Draw>),
}

impl Draw {
    /// Draws. `variable` knows those that were drawn before.
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

    /// Within what its numbers lie; none where it draws words.
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

    /// What it may come to in the end: the values that are always the same, and the ways that draw a number.
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

    /// The words that it may draw.
    pub fn words(&self) -> Vec<&str> {
        let word = |end| if let &Self::Always(Drawn::Word(ref word)) = end { Some(word.as_str()) } else { None };
        self.ends().into_iter().filter_map(word).collect()
    }

    /// The variables that it asks for.
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
    /// The number that it is.
    pub fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self { Some(*number) } else { None }
    }

    /// With six digits that count, or none behind the point: what a person reads, and all that a draw is worth.
    pub fn rounded(self, whole: bool) -> Self {
        match self {
            Self::Number(number) if whole => Self::Number((number + 0.5).floor()),
            Self::Number(number) => Self::Number(format!("{number:.5e}").parse().unwrap_or(number) + 0.0),
            word => word,
        }
    }
}

/// How values are spread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// How many.
    pub count: usize,
    /// Half of them are below this.
    pub median: Option<f64>,
    /// 95 % of them are at or below this.
    pub most: Option<f64>,
    /// The largest.
    pub worst: Option<f64>,
}

impl Spread {
    /// Of values in any order.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let rank = |share: f64| values.get(((values.len() as f64 * share).ceil() as usize).max(1) - 1).copied();
        Self { count: values.len(), median: rank(0.5), most: rank(0.95), worst: values.last().copied() }
    }

    /// For scripts.
    pub fn json(&self) -> Value {
        json!({ "count": self.count, "median": self.median, "percentile_95": self.most, "worst": self.worst })
    }
}
