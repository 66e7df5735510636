#ifndef TEST_ITERSOLVE_H
#define TEST_ITERSOLVE_H
enum { AF_X = 1 << 0, AF_Y = 1 << 1, AF_Z = 1 << 2 };
struct stepper_kinematics;
struct move;
typedef double (*sk_calc_callback)(struct stepper_kinematics *sk, struct move *m, double move_time);
struct stepper_kinematics {
    double commanded_pos;
    int active_flags;
    sk_calc_callback calc_position_cb;
};
#endif
