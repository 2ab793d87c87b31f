//! A key that varies.

/// A key and its values, as a scene's text has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vary {
    /// `table.key`.
    pub key: String,
    /// From the first to the last.
    pub values: Vec<String>,
}

/// Values where none are asked for.
const VALUES: usize = 5;
/// More are a slip of the keyboard.
const MOST: usize = 100_000;

impl std::str::FromStr for Vary {
    type Err = String;

    /// Reads `table.key=lo..hi` or `table.key=lo..hi:n`. Between whole ends the values are whole where they come out
    /// so.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("--vary {text}: table.key=lo..hi or table.key=lo..hi:n is asked for");
        let (key, range) = text.split_once('=').ok_or_else(wrong)?;
        let (range, count) = match range.split_once(':') {
            Some((range, count)) => (range, count.trim().parse().map_err(|_| wrong())?),
            None => (range, VALUES),
        };
        let (low, high) = range.split_once("..").ok_or_else(wrong)?;
        let end = |text: &str| text.trim().parse::<f64>().ok().filter(|end| end.is_finite()).ok_or_else(wrong);
        let (low_end, high_end) = (end(low)?, end(high)?);
        if count > MOST {
            return Err(format!("--vary {text}: {count} values, at most {MOST} are allowed"));
        }
        if key.trim().is_empty() || count == 0 || (count == 1 && low_end != high_end) {
            return Err(wrong());
        }
        let whole = [low, high].iter().all(|end| end.trim().parse::<i64>().is_ok());
        let value = |n: usize| {
            let share = if count > 1 { n as f64 / (count - 1) as f64 } else { 0.0 };
            let value = low_end + (high_end - low_end) * share;
            // Sums of tenths and the like come out as they are meant.
            let value = format!("{value:.12e}").parse().unwrap_or(value);
            if whole && value.fract() == 0.0 { format!("{value}") } else { format!("{value:?}") }
        };
        Ok(Self { key: key.trim().into(), values: (0..count).map(value).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read() {
        let values = |text: &str| text.parse::<Vary>().map(|vary| vary.values.join(" "));
        assert_eq!(values("tip.radius_mm=8..12"), Ok("8 9 10 11 12".into()));
        assert_eq!(values("tip.radius_mm=0.1..0.3:3"), Ok("0.1 0.2 0.3".into()));
        assert_eq!(values("tip.radius_mm=1..2:3"), Ok("1 1.5 2".into()));
        assert_eq!(values("a.b=-1..1:2"), Ok("-1 1".into()));
        assert_eq!(values("a.b=7..7:1"), Ok("7".into()));
        for wrong in
            ["a.b", "a.b=1", "a.b=1..x", "=1..2", "a.b=1..2:0", "a.b=1..2:1", "a.b=1..inf", "a.b=1..2:1000000000000"]
        {
            assert!(values(wrong).is_err(), "{wrong}");
        }
    }
}
