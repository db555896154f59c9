/* What messages between two ranks cost, in the way razy-sweep sends them (src/sweep/message.f90):
 *
 *     mpirun -n 2 messages [ROUNDS]
 *
 * Synchronous-mode sends, matched probes, nobody blocks. Prints, as "name value" in seconds,
 *   trip_N    half a round trip of a message of N words of 64 bits: the fastest of the batches' medians and of all trips,
 *   serve_N   time of rank 0 for a message of N words that has arrived: look, take, and look whether it is complete,
 *   send_N    time of rank 0 for posting a message of N words.
 * Rank 0 times serve and send by itself, so neither contains the way of the message. */
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { BATCHES = 50, LONGEST = 4096 };
static long long words[LONGEST];

static int compare(const void *a, const void *b) {
   double x = *(const double *)a, y = *(const double *)b;
   return (x > y) - (x < y);
}

static void wait_for(MPI_Request *request) {
   int done = 0;
   while (!done) MPI_Test(request, &done, MPI_STATUS_IGNORE);
}

static void put(int n, int other) {
   MPI_Request request;
   MPI_Issend(words, n, MPI_LONG_LONG, other, 1, MPI_COMM_WORLD, &request);
   wait_for(&request);
}

/* Take a message that may not have come yet; the time from the look that finds it to its completion. */
static double take(void) {
   MPI_Message message;
   MPI_Request request;
   MPI_Status status;
   int found = 0, n;
   double begun = 0;
   while (!found) {
      begun = MPI_Wtime();
      MPI_Improbe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &found, &message, &status);
   }
   MPI_Get_count(&status, MPI_LONG_LONG, &n);
   MPI_Imrecv(words, n, MPI_LONG_LONG, &message, &request);
   wait_for(&request);
   return MPI_Wtime() - begun;
}

static double median(double *times, int n) {
   qsort(times, n, sizeof *times, compare);
   return times[n / 2];
}

int main(int count, char **arguments) {
   const int sizes[] = {2, 64, LONGEST};
   int rank, rounds = 1000;
   MPI_Init(&count, &arguments);
   MPI_Comm_rank(MPI_COMM_WORLD, &rank);
   if (count > 1) rounds = atoi(arguments[1]);
   if (rounds < 1) rounds = 1;
   double *times = malloc(3 * rounds * sizeof *times), *serve = times + rounds, *post = serve + rounds;
   for (int s = 0; s < 3; s++) {
      const int n = sizes[s];
      double best_trip = 1, best_serve = 1, best_post = 1, shortest = 1;
      for (int batch = 0; batch < BATCHES; batch++) {
         MPI_Barrier(MPI_COMM_WORLD);
         for (int i = 0; i < rounds; i++) {
            if (rank == 0) {
               double begun = MPI_Wtime();
               put(n, 1);
               take();
               times[i] = 0.5 * (MPI_Wtime() - begun);
               if (times[i] < shortest) shortest = times[i];
            } else {
               take();
               put(n, 0);
            }
         }
         double middle = median(times, rounds);
         if (middle < best_trip) best_trip = middle;
         MPI_Barrier(MPI_COMM_WORLD);
         /* Rank 1 sends, rank 0 gives the message time to arrive; then rank 0 posts one and rank 1 takes it. */
         for (int i = 0; i < rounds / 10 + 1; i++) {
            MPI_Barrier(MPI_COMM_WORLD);
            if (rank == 0) {
               usleep(200);
               serve[i] = take();
               MPI_Request request;
               double begun = MPI_Wtime();
               MPI_Issend(words, n, MPI_LONG_LONG, 1, 1, MPI_COMM_WORLD, &request);
               post[i] = MPI_Wtime() - begun;
               wait_for(&request);
            } else {
               put(n, 0);
               take();
            }
         }
         middle = median(serve, rounds / 10 + 1);
         if (middle < best_serve) best_serve = middle;
         middle = median(post, rounds / 10 + 1);
         if (middle < best_post) best_post = middle;
      }
      if (rank == 0)
         printf("trip_%d %.3e\nshortest_%d %.3e\nserve_%d %.3e\nsend_%d %.3e\n", n, best_trip, n, shortest, n, best_serve, n,
                best_post);
   }
   free(times);
   MPI_Finalize();
   return 0;
}
