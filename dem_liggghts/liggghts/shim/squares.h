// Elements that do not move in squares of a plane, as search/squares.py sorts them: of a large terrain only those near
// a particle are looked at.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "geometry.h"

struct Squares {
    std::vector<int64_t> start = {0, 0};  // where each square begins in element, the second axis fastest, and the end
    std::vector<int> element, loose;      // those that reach into each; elements in no square
    int axis[2] = {0, 1}, shape[2] = {1, 1};
    double lower[2] = {0, 0}, side = 1, depth = 0, disc = 0;  // the two last: largest of the elements in squares

    // Calls tell(element) for the elements in the squares that a box of half the side ``most`` around p reaches into:
    // for one that reaches into several of them several times.
    template <class Tell> void each_near(const Vec &p, double most, Tell tell) const
    {
        const double at[3] = {p.x, p.y, p.z};
        int first[2], last[2];
        for (int k = 0; k < 2; k++) {
            first[k] = square(at[axis[k]] - most, k);
            last[k] = square(at[axis[k]] + most, k);
        }
        for (int s = first[0]; s <= last[0]; s++)
            for (int r = first[1]; r <= last[1]; r++) {
                const int64_t cell = int64_t(s) * shape[1] + r;
                for (int64_t q = start[cell]; q < start[cell + 1]; q++) tell(element[q]);
            }
    }

    int square(double value, int k) const  // beyond the ends the last one
    {
        const double number = (value - lower[k]) / side;
        return number > 0 ? int(std::min(number, shape[k] - 1.0)) : 0;
    }
};
