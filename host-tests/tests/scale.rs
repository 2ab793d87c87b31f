//! What a kitchen scale shows, and the factor that comes of it.

use fingertip::calibrate::scale::{Refusal, Scale, Standing};
use fingertip::contact::Contact;
use fingertip::state::Mode;
use fingertip::units::Newtons;
use host_tests::finger::config;

/// As many numbers as it takes.
const POINTS: usize = 8;

fn held(scale: &mut Scale, read_n: f64, shown_mn: i32) -> Option<Refusal> {
    let config = config();
    let contact = Contact { force: Newtons::from_bits((read_n * 65_536.0) as i32), ..Contact::default() };
    scale.observe(Mode::Approach, contact.force, contact.force, &config);
    for _ in 0..8_000 {
        scale.observe(Mode::Force, contact.force, contact.force, &config);
    }
    scale.take(shown_mn, &contact);
    scale.standing().refusal
}

#[test]
fn three_numbers_make_the_factor() {
    let mut scale = Scale::new();
    assert_eq!(scale.standing(), Standing::default());
    for (read_n, shown_mn) in [(1.0, 1_085), (2.0, 2_160), (4.0, 4_315)] {
        assert_eq!(held(&mut scale, read_n, shown_mn), None);
    }
    let Standing { points, factor_ppm, sigma_ppm, .. } = scale.standing();
    assert_eq!(points, 3);
    assert!(
        (1_078_000..1_081_000).contains(&factor_ppm) && (500..2_500).contains(&sigma_ppm),
        "{factor_ppm} {sigma_ppm}"
    );
    scale.forget();
    assert_eq!(scale.standing(), Standing::default());
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut scale = Scale::new();
    assert_eq!(held(&mut scale, 2.0, 2_100), None);
    let before = Standing { refusal: None, ..scale.standing() };
    for (read_n, shown_mn, refusal) in [
        (1.0, 990, Refusal::Contradiction),
        (1.0, 1_250, Refusal::Contradiction),
        (1.0, 2_100, Refusal::Range),
        (1.0, 490, Refusal::Range),
        (0.09, 99, Refusal::TooLittle),
        (1.0, -5, Refusal::TooLittle),
        (1.0, i32::MIN, Refusal::TooLittle),
        (1.0, i32::MAX, Refusal::Range),
    ] {
        assert_eq!(held(&mut scale, read_n, shown_mn), Some(refusal), "{shown_mn} for {read_n} N");
        assert_eq!(Standing { refusal: None, ..scale.standing() }, before);
    }
    for _ in 1..POINTS {
        assert_eq!(held(&mut scale, 2.0, 2_100), None);
    }
    assert_eq!(held(&mut scale, 2.0, 2_100), Some(Refusal::TooMany));
    let contact = Contact { doubt: 1, force: Newtons::from_bits(2 << 16), ..Contact::default() };
    scale.forget();
    scale.take(2_000, &contact);
    assert_eq!(scale.standing().refusal, Some(Refusal::OffArray));
    let mut scale = Scale::new();
    scale.take(2_000, &Contact { doubt: 0, ..contact });
    assert_eq!(scale.standing().refusal, Some(Refusal::NotHeld));
}
