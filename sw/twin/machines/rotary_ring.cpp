// SPDX-License-Identifier: Apache-2.0
#include "machines/rotary_ring.h"

#include <algorithm>
#include <cmath>

#include "parts/random_source.h"

namespace twin {

namespace {
constexpr double TURN = 2 * M_PI, ARC_SECOND = M_PI / 180 / 3600;
constexpr double DRIFT_PERIOD_S[] = {211, 67, 23}, DRIFT_SHARE[] = {0.6, 0.3, 0.1};
}  // namespace

RotaryRing::RotaryRing(const RotaryRingParameters& parameters, uint64_t seed) : p_(parameters) {
    RandomSource random(seed, 0x21C6);
    const double first[] = {p_.ring_eccentricity, p_.ring_tilt, p_.ring_distortion};
    const int highest = std::min(ORDERS, int(p_.ring_highest_order));
    for (int k = 1; k <= highest; k++) {
        const double nominal = k <= 3 ? first[k - 1] : p_.ring_higher * 4 / k;
        amplitude[size_t(k)] = nominal * (1 + p_.ring_spread * random.uniform(-1, 1)) * ARC_SECOND;
        phase[size_t(k)] = TURN * random.uniform();
    }
    line_phase_ = TURN * random.uniform();
    for (double& slow : drift_phase_) slow = TURN * random.uniform();
    const double scale = p_.ring_peak * ARC_SECOND / peak();
    for (double& a : amplitude) a *= scale;
}

double RotaryRing::peak() const {
    constexpr int POINTS = 64 * ORDERS;
    double most = 0;
    for (int n = 0; n < POINTS; n++) {
        double sum = 0;
        for (int k = 1; k <= ORDERS; k++)
            sum += amplitude[size_t(k)] * std::sin(TURN * k * n / POINTS + phase[size_t(k)]);
        most = std::fmax(most, std::fabs(sum));
    }
    return most;
}

double RotaryRing::error(double angle) const {
    double s, c,
        sum = p_.ring_line_error * ARC_SECOND * std::sin(p_.ring_lines * angle + line_phase_);
    sincos(angle, &s, &c);
    double sine = 0, cosine = 1;  // of k angle, one rotation an order
    for (int k = 1; k <= std::min(ORDERS, int(p_.ring_highest_order)); k++) {
        const double next = sine * c + cosine * s;
        cosine = cosine * c - sine * s;
        sine = next;
        sum += amplitude[size_t(k)] *
               (sine * std::cos(phase[size_t(k)]) + cosine * std::sin(phase[size_t(k)]));
    }
    return sum;
}

double RotaryRing::drift(double seconds) const {
    double sum = 0;
    for (int n = 0; n < SLOW; n++)
        sum +=
            DRIFT_SHARE[n] * std::sin(TURN * seconds / DRIFT_PERIOD_S[n] + drift_phase_[size_t(n)]);
    return p_.ring_drift * ARC_SECOND * sum;
}

int64_t RotaryRing::counts(double measured) const {
    return int64_t(std::floor(measured / TURN * 4 * p_.ring_lines * p_.ring_subdivision));
}

unsigned RotaryRing::levels(double measured) const {
    const int64_t count = counts(measured), turn = int64_t(4 * p_.ring_lines * p_.ring_subdivision);
    const unsigned quarter = unsigned(count) & 3;
    const bool z = ((count - int64_t(p_.ring_index_count)) % turn + turn) % turn <
                   int64_t(p_.ring_index_width);
    return ((quarter ^ quarter >> 1) & 1) | quarter >> 1 << 1 | unsigned(z) << 2;
}

}  // namespace twin
