//! A draw from its text: `{ uniform = [1, 10] }`, and the like.

use super::draw::{Draw, Drawn};
use super::expression::Expression;
use crate::scene::error::alike;
use std::ops::Range;
use toml_edit::{InlineTable, Value};

/// What is wrong, where, and what is allowed.
pub type Wrong = (Range<usize>, String, String);

/// The ways to draw.
pub const WAYS: [&str; 6] = ["uniform", "log_uniform", "normal", "choice", "is", "by"];
const EXAMPLES: &str = "{ uniform = [1, 10] }, { log_uniform = [0.3, 3] }, { normal = [0, 0.05] } (mean, deviation), \
    { choice = [256, 512], weights = [1, 2] }, { is = \"1000 * modulus_kpa\" }, { by = \"thing\", ball = 0.05, otherwise = 0 }; \
    with follows = \"magnitude\" or \"1 / magnitude\"";

/// Reads draws: at one magnitude, with the variables that were read before.
pub struct DrawReader<'a> {
    /// What `follows` multiplies or divides by.
    pub magnitude: f64,
    /// Variables that may be used.
    pub variables: &'a [(String, Draw)],
}

impl DrawReader<'_> {
    /// What a value says: a draw, or always the same.
    ///
    /// # Errors
    /// It is neither.
    pub fn draw(&self, value: &Value) -> Result<Draw, Wrong> {
        let number = number(value).map(Drawn::Number);
        match (value.as_inline_table(), number.or_else(|| value.as_str().map(|word| Drawn::Word(word.into())))) {
            (Some(table), _) => self.table(table, at(value)),
            (None, Some(always)) => Ok(Draw::Always(always)),
            (None, None) => Err(wrong(value, "this cannot be drawn", EXAMPLES)),
        }
    }

    fn table(&self, table: &InlineTable, place: Range<usize>) -> Result<Draw, Wrong> {
        let mut ways = WAYS.iter().filter_map(|way| Some((*way, table.get(way)?)));
        let (Some((way, value)), None) = (ways.next(), ways.next()) else {
            let given: Vec<&str> = table.iter().map(|(name, _)| name).collect();
            let meant = given.iter().find_map(|name| alike(name, WAYS));
            let meant = meant.map_or(String::new(), |way| format!("; did you mean `{way}`?"));
            return Err((place, format!("a draw has one way to be drawn{meant}"), EXAMPLES.into()));
        };
        let draw = match way {
            "uniform" => Draw::Uniform(self.ends(value)?),
            "log_uniform" => Draw::LogUniform(self.positive(value)?),
            "normal" => Draw::Normal(self.mean(value)?),
            "choice" => self.choice(value, table.get("weights"))?,
            "is" => Draw::Is(self.expression(value)?),
            _ => self.by(table, value)?,
        };
        let known =
            |name: &str| name == way || name == "follows" || way == "by" || way == "choice" && name == "weights";
        if let Some((name, value)) = table.iter().find(|(name, _)| !known(name)) {
            return Err(wrong(value, &format!("`{name}` does not go with `{way}`"), EXAMPLES));
        }
        let words = draw.words().len();
        if words > 0 && words < draw.ends().len() {
            return Err(wrong(value, "a draw is of words or of numbers", "all of them words, or none"));
        }
        Ok(match table.get("follows").map(|value| (value, value.as_str())) {
            None => draw,
            Some((value, _)) if words > 0 => return Err(wrong(value, "words follow nothing", "no `follows`")),
            Some((_, Some("magnitude"))) => Draw::Times(self.magnitude, Box::new(draw)),
            Some((_, Some("1 / magnitude"))) => Draw::Times(1.0 / self.magnitude, Box::new(draw)),
            Some((value, _)) => {
                return Err(wrong(value, "nothing else can be followed", "\"magnitude\" or \"1 / magnitude\""));
            }
        })
    }

    fn pair(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let numbers: Option<Vec<f64>> = value.as_array().map(|array| array.iter().filter_map(number).collect());
        numbers
            .and_then(|numbers| numbers.try_into().ok())
            .ok_or_else(|| wrong(value, "two numbers are asked for", EXAMPLES))
    }

    fn ends(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let [low, high] = self.pair(value)?;
        if low <= high {
            return Ok([low, high]);
        }
        Err(wrong(value, &format!("the least, {low}, is above the largest, {high}"), "[least, largest]"))
    }

    fn positive(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let ends = self.ends(value)?;
        if ends[0] > 0.0 {
            return Ok(ends);
        }
        Err(wrong(value, "a ratio needs ends above 0", "[least, largest], both above 0; or `uniform`"))
    }

    fn mean(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let [mean, deviation] = self.pair(value)?;
        if deviation >= 0.0 {
            return Ok([mean, deviation]);
        }
        Err(wrong(value, &format!("a deviation of {deviation}"), "[mean, deviation], the deviation 0 or more"))
    }

    fn choice(&self, value: &Value, weights: Option<&Value>) -> Result<Draw, Wrong> {
        let given: Vec<&Value> = value.as_array().map(|array| array.iter().collect()).unwrap_or_default();
        if given.is_empty() {
            return Err(wrong(value, "there is nothing to choose from", "choice = [256, 512, 1024]"));
        }
        let draws = given.into_iter().map(|value| self.draw(value)).collect::<Result<Vec<_>, _>>()?;
        let shares = match weights {
            None => vec![1.0; draws.len()],
            Some(weights) => {
                let all: Vec<f64> =
                    weights.as_array().map(|array| array.iter().filter_map(number).collect()).unwrap_or_default();
                let sound = all.len() == draws.len() && all.iter().all(|w| *w >= 0.0) && all.iter().any(|w| *w > 0.0);
                if !sound {
                    let allowed = format!("{} numbers, none below 0 and one above", draws.len());
                    return Err(wrong(weights, "these are no weights of the choice", &allowed));
                }
                all
            }
        };
        Ok(Draw::Choice(shares.into_iter().zip(draws).collect()))
    }

    fn expression(&self, value: &Value) -> Result<Expression, Wrong> {
        let allowed = "+ - * / and ( ) with numbers and variables of [draw], such as \"1000 * modulus_kpa\"";
        let text = value.as_str().ok_or_else(|| wrong(value, "an expression is a text", allowed))?;
        let expression = Expression::read(text).map_err(|error| wrong(value, &error, allowed))?;
        for name in expression.variables() {
            if !self.known(name, value)?.words().is_empty() {
                return Err(wrong(value, &format!("`{name}` is a word, and cannot be reckoned with"), allowed));
            }
        }
        Ok(expression)
    }

    fn by(&self, table: &InlineTable, value: &Value) -> Result<Draw, Wrong> {
        let name = value.as_str().ok_or_else(|| wrong(value, "`by` names a variable", EXAMPLES))?;
        let words = self.known(name, value)?.words();
        if words.is_empty() {
            return Err(wrong(value, &format!("`{name}` is a number"), "a variable that is a choice of words"));
        }
        let (mut cases, mut otherwise) = (Vec::new(), None);
        for (case, value) in table.iter().filter(|(case, _)| !["by", "follows"].contains(case)) {
            let draw = self.draw(value)?;
            if case == "otherwise" {
                otherwise = Some(Box::new(draw));
            } else if words.contains(&case) {
                cases.push((case.to_owned(), draw));
            } else {
                return Err(wrong(value, &format!("`{name}` is never \"{case}\""), &words.join(", ")));
            }
        }
        let missing = words.iter().find(|word| otherwise.is_none() && cases.iter().all(|(case, _)| case != *word));
        if let Some(missing) = missing {
            return Err(wrong(
                value,
                &format!("nothing is said for \"{missing}\""),
                "a value for each, or `otherwise`",
            ));
        }
        Ok(Draw::By(name.into(), cases, otherwise))
    }

    fn known(&self, name: &str, value: &Value) -> Result<&Draw, Wrong> {
        let found = self.variables.iter().find(|(known, _)| known == name).map(|(_, draw)| draw);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.variables.iter().map(|(name, _)| name.as_str()).collect();
            let meant = alike(name, names.iter().copied());
            let meant = meant.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
            wrong(value, &format!("no variable `{name}` stands in [draw] before{meant}"), &names.join(", "))
        })
    }
}

/// A number that is finite.
pub fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64)).filter(|number| number.is_finite())
}

fn at(value: &Value) -> Range<usize> {
    value.span().unwrap_or(0..0)
}

fn wrong(value: &Value, message: &str, allowed: &str) -> Wrong {
    (at(value), message.into(), allowed.into())
}
