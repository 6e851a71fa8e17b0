//! Position of the sun by place and time: low-accuracy algorithm of Meeus, "Astronomical Algorithms" (1998),
//! chapters 12, 16, 22 and 25, which the NOAA calculator uses too. Its error is 0.01 degrees from 1950 to
//! 2050.

/// Julian date of 2000-01-01, 12:00.
const J2000: f64 = 2_451_545.0;

/// Difference of terrestrial and universal time in days, within a minute from 1960 to 2050. The sun moves
/// 0.0007 degrees in a minute.
const DELTA_T: f64 = 69.0 / 86400.0;

/// Horizontal parallax of the sun in degrees.
const PARALLAX: f64 = 8.794 / 3600.0;

/// A moment of universal time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    julian: f64,
}

/// The sun over the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// Degrees above the horizon, refraction included.
    pub elevation: f64,
    /// Degrees from north to east, 0 to 360.
    pub azimuth: f64,
}

impl Moment {
    /// A day of the Gregorian calendar and the hours since its midnight, in universal time; the hours may lie
    /// outside of the day. `None` if the calendar has no such day, or for years before 1600 and after 2400.
    pub fn new(year: i32, month: u32, day: u32, hours: f64) -> Option<Self> {
        let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
        let days = match month {
            4 | 6 | 9 | 11 => 30,
            2 => 28 + u32::from(is_leap),
            1..=12 => 31,
            _ => return None,
        };
        if !(1..=days).contains(&day) || !(1600..=2400).contains(&year) {
            return None;
        }
        // Meeus, chapter 7: January and February count as months 13 and 14 of the year before.
        let (year, month) = if month > 2 { (year, month) } else { (year - 1, month + 12) };
        let (year, month) = (f64::from(year), f64::from(month));
        let century = (year / 100.0).floor();
        let leap_days = 2.0 - century + (century / 4.0).floor();
        let months = (30.6001 * (month + 1.0)).floor();
        let midnight = (365.25 * (year + 4716.0)).floor() + months + f64::from(day) + leap_days - 1524.5;
        Some(Self { julian: midnight + hours / 24.0 })
    }

    /// Apparent right ascension and declination of the sun in degrees, and the nutation in right ascension.
    fn equatorial(self) -> (f64, f64, f64) {
        let t = (self.julian + DELTA_T - J2000) / 36525.0;
        let mean_longitude = 280.46646 + t * (36000.76983 + t * 0.000_303_2);
        let anomaly = (357.52911 + t * (35999.05029 - t * 0.000_153_7)).to_radians();
        let centre = (1.914602 - t * (0.004817 + t * 0.000014)) * anomaly.sin()
            + (0.019993 - t * 0.000101) * (2.0 * anomaly).sin()
            + 0.000289 * (3.0 * anomaly).sin();
        let node = (125.04 - 1934.136 * t).to_radians();
        let nutation = -0.00478 * node.sin();
        let longitude = (mean_longitude + centre - 0.00569 + nutation).to_radians();
        let obliquity = 23.439291 - t * (0.013004 + t * 1.64e-7) + 0.00256 * node.cos();
        let (sin, cos) = obliquity.to_radians().sin_cos();
        let right_ascension = (cos * longitude.sin()).atan2(longitude.cos());
        let declination = (sin * longitude.sin()).asin();
        (right_ascension.to_degrees(), declination.to_degrees(), nutation * cos)
    }

    /// The sun at a `latitude` (degrees, north positive) and a `longitude` (degrees, east positive).
    pub fn sun(self, latitude: f64, longitude: f64) -> SunPosition {
        let (right_ascension, declination, nutation) = self.equatorial();
        let days = self.julian - J2000;
        let t = days / 36525.0;
        let sidereal = 280.46061837 + 360.985_647_366_29 * days + t * t * 0.000_387_933 + nutation;
        let hour_angle = (sidereal + longitude - right_ascension).to_radians();
        let (sin_lat, cos_lat) = latitude.to_radians().sin_cos();
        let (sin_dec, cos_dec) = declination.to_radians().sin_cos();
        let up = sin_lat * sin_dec + cos_lat * cos_dec * hour_angle.cos();
        let north = cos_lat * sin_dec - sin_lat * cos_dec * hour_angle.cos();
        let east = -cos_dec * hour_angle.sin();
        let height = up.clamp(-1.0, 1.0).asin();
        let topocentric = height.to_degrees() - PARALLAX * height.cos();
        SunPosition {
            elevation: topocentric + refraction(topocentric),
            azimuth: east.atan2(north).to_degrees().rem_euclid(360.0),
        }
    }
}

/// Refraction in degrees of a body at so many degrees above the horizon, for 1010 hPa and 10 °C (Sæmundsson
/// 1986). Zero for a sun below the horizon.
fn refraction(height: f64) -> f64 {
    if height < -1.0 {
        return 0.0;
    }
    let minutes = 1.02 / (height + 10.3 / (height + 5.11)).to_radians().tan();
    (minutes / 60.0).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Accuracy that scenes rely on, in degrees.
    const ACCURACY: f64 = 0.02;

    #[test]
    fn right_ascension_and_declination_are_those_of_the_almanac() {
        // Meeus, example 25.b: 1992 October 13, 0h TD, by VSOP87.
        let moment = Moment { julian: 2_448_908.5 - DELTA_T };
        let (right_ascension, declination, _) = moment.equatorial();
        assert!((right_ascension.rem_euclid(360.0) - 198.378_121).abs() < ACCURACY, "{right_ascension}");
        assert!((declination - -7.783_819).abs() < ACCURACY, "{declination}");
    }

    #[test]
    fn days_of_the_calendar_have_their_julian_date() {
        // Meeus, chapter 7.
        for ((year, month, day), hours, julian) in [
            ((2000, 1, 1), 12.0, 2_451_545.0),
            ((1999, 1, 1), 0.0, 2_451_179.5),
            ((1987, 1, 27), 0.0, 2_446_822.5),
            ((1988, 6, 19), 12.0, 2_447_332.0),
            ((1900, 1, 1), 0.0, 2_415_020.5),
            ((1600, 12, 31), 0.0, 2_305_812.5),
        ] {
            assert_eq!(Moment::new(year, month, day, hours), Some(Moment { julian }), "{year}");
        }
        for (year, month, day) in [(2023, 2, 29), (2024, 2, 30), (2024, 13, 1), (2024, 4, 31), (2024, 1, 0)] {
            assert_eq!(Moment::new(year, month, day, 0.0), None);
        }
    }

    #[test]
    fn elevation_and_azimuth_are_those_of_the_solar_position_algorithm() {
        // Reda and Andreas 2008, appendix A.5: 2003-10-17, 12:30:30 at UTC-7, Golden; elevation before
        // refraction 39.872046, azimuth 194.340241.
        let moment = Moment::new(2003, 10, 17, 19.5 + 30.0 / 3600.0).unwrap();
        let sun = moment.sun(39.742476, -105.1786);
        assert!((sun.elevation - refraction(39.872046) - 39.872046).abs() < ACCURACY, "{sun:?}");
        assert!((sun.azimuth - 194.340241).abs() < ACCURACY, "{sun:?}");
    }

    #[test]
    fn refraction_is_that_of_the_tables() {
        // Meeus, example 16.a: 24.618 minutes of arc at an apparent height of 0.5541 degrees.
        let sun = 33.0 / 60.0 + 20.0 / 3600.0;
        assert!((refraction(sun) - 24.618 / 60.0).abs() < ACCURACY);
        assert!((refraction(90.0)).abs() < 1e-4 && refraction(-5.0) == 0.0);
    }
}
