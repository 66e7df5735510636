#ifndef TEST_TRAPQ_H
#define TEST_TRAPQ_H
struct coord {
    double x, y, z;
};
/* A move at constant speed. */
struct move {
    struct coord start, speed;
};
static inline struct coord move_get_coord(struct move *m, double t) {
    struct coord c = {m->start.x + t * m->speed.x, m->start.y + t * m->speed.y, m->start.z + t * m->speed.z};
    return c;
}
#endif
