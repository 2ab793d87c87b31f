//! What the machines answer, number by number into a digest.

use super::Mix;
use fingertip::contact::Contact;
use fingertip::control::Reference;
use fingertip::shipped::Picture;

/// What the profile asks for.
pub fn add_reference(mix: &mut Mix, reference: Reference) {
    mix.add(reference.speed.to_bits());
    mix.add(reference.acceleration.to_bits());
}

/// All of a picture.
pub fn add_picture(mix: &mut Mix, picture: &Picture) {
    let Picture { taxels, sum, moment_x, moment_y, peak, bad, bad_count, bad_again, undriven_max, peak_codes } =
        picture;
    taxels.iter().flatten().chain([sum, moment_x, moment_y, peak]).for_each(|number| mix.add(*number));
    bad.iter().for_each(|row| mix.add(*row));
    [undriven_max, peak_codes].into_iter().for_each(|number| mix.add(*number));
    mix.add(*bad_count);
    mix.add(*bad_again);
}

/// All of a contact.
pub fn add_contact(mix: &mut Mix, contact: &Contact) {
    let Contact { force, indentation, centre_x, centre_y, radius, peak_pa, confidence, doubt, bad_taxels } = *contact;
    mix.add(force.to_bits());
    for length in [indentation, centre_x, centre_y, radius] {
        mix.add(length.to_bits());
    }
    mix.add(peak_pa);
    mix.add(confidence);
    mix.add(doubt);
    mix.add(bad_taxels);
}
