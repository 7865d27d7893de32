// SPDX-License-Identifier: Apache-2.0
// Motor shaft, transmission with spring and backlash, body on guides between end stops. For a body
// that turns read kgm2, rad and Nm for kg, m and N.
//
//   nut    = angle * travel per radian + error
//   force  = preload + spring and damper between nut and body
//
// The nut is where the transmission would carry the body without a force. Spring and damper act
// beyond the backlash on either side.
#pragma once
#include "parts/friction.h"

namespace twin {

struct DrivetrainParameters {
    double shaft_inertia, travel_per_radian, stiffness, damping, backlash, preload, mass;
    Friction bearing, guide;  // of the shaft, of the body
    double low_stop, high_stop, stop_stiffness, stop_damping;
};

// from the parameters of a machine with a motor, a screw and a table
template <class P>
DrivetrainParameters screw_and_table(const P& p) {
    return {p.motor_inertia,
            p.screw_lead / (2 * M_PI),
            p.screw_stiffness,
            p.screw_damping,
            p.screw_backlash,
            p.screw_preload,
            p.table_mass,
            {p.motor_coulomb, p.motor_static, p.motor_stribeck_velocity, p.motor_viscous,
             p.motor_presliding, p.motor_presliding_damping},
            {p.table_coulomb, p.table_static, p.table_stribeck_velocity, p.table_viscous,
             p.table_presliding, p.table_presliding_damping},
            p.travel_low_stop,
            p.travel_high_stop,
            p.travel_stop_stiffness,
            p.travel_stop_damping};
}

class Drivetrain {
 public:
    void configure(const DrivetrainParameters& parameters) {  // keeps the state
        const double wound = p.bearing.deflection, pushed = p.guide.deflection;
        p = parameters;
        p.bearing.deflection = wound;
        p.guide.deflection = pushed;
    }
    void set_position(double where) {  // at rest, preload and transmission in equilibrium
        position = where;
        velocity = speed = 0;
        p.bearing.deflection = p.guide.deflection = 0;
        // the flank carries the preload, so nothing pulls at the body
        angle = (where - error - p.backlash / 2 - p.preload / p.stiffness) / p.travel_per_radian;
    }
    double nut() const { return angle * p.travel_per_radian + error; }
    double force() const {  // on the body
        const double stretch = nut() - position, rate = speed * p.travel_per_radian - velocity,
                     play = p.backlash / 2;
        double flank = 0;
        if (stretch > play)
            flank = std::fmax(0, p.stiffness * (stretch - play) + p.damping * rate);
        else if (stretch < -play)
            flank = std::fmin(0, p.stiffness * (stretch + play) + p.damping * rate);
        return flank + p.preload;
    }
    void step(double torque, double dt) {  // of the motor
        const double push = force();
        double stop = 0;
        if (position < p.low_stop)
            stop = std::fmax(
                0, p.stop_stiffness * (p.low_stop - position) - p.stop_damping * velocity);
        else if (position > p.high_stop)
            stop = std::fmin(
                0, p.stop_stiffness * (p.high_stop - position) - p.stop_damping * velocity);

        if (jammed)
            speed = 0;
        else
            speed += dt / p.shaft_inertia *
                     (torque - p.bearing.force(speed, dt) - p.travel_per_radian * push);
        if (clamped)
            velocity = 0;
        else
            velocity += dt / p.mass * (push + stop + external_force - p.guide.force(velocity, dt));
        angle += dt * speed;
        position += dt * velocity;
    }

    double position = 0, velocity = 0;  // of the body
    double angle = 0, speed = 0;        // of the shaft, rad, rad/s
    double error = 0;                   // of the transmission, as m or rad of the body
    double external_force = 0;          // on the body
    bool jammed = false;                // the shaft does not turn
    bool clamped = false;               // the body does not move

 private:
    DrivetrainParameters p{};
};

}  // namespace twin
