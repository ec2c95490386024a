//! The picture of a circle's centre is not the centre of the circle's picture.
