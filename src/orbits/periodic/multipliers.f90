!! Floquet multipliers of a periodic motion, with how far off each may be.
module razy_orbits_periodic_multipliers
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: right_eigen
   use razy_orbits_periodic_orbit, only: orbit_t, scaled
   use razy_orbits_periodic_problem, only: problem_t
   implicit none(type, external)
   private

   public :: find_multipliers

   !> Rounding that an event adds to the derivative of the map, relative to its size.
   real(wp), parameter :: rounding_of_event = 64*epsilon(1.0_wp)

   !> How much more the derivative may change in a direction that Newton's method did not go.
   real(wp), parameter :: all_ways = 4.0_wp

contains

   !> Floquet multipliers of a motion that was found; without excitation but for the one along the motion, the nearest to 1. The
   !> derivative errs by rounding, and by how it changes with the motion, which errs by its last correction and rounding too: much
   !> beside a grazing. An error of the derivative moves each by itself over the cosine between its left and right eigenvectors, and
   !> where these are at right angles by its square root.
   subroutine find_multipliers(problem, orbit)
      type(problem_t), intent(in) :: problem
      type(orbit_t), intent(inout) :: orbit

      complex(wp), dimension(problem%map%n, problem%map%n) :: left, right
      complex(wp) :: values(problem%map%n)
      real(wp), allocatable :: matrix(:, :), s(:)
      real(wp) :: error, length
      integer :: i, info, k

      associate (n => problem%map%n)
         s = problem%scales()
         matrix = scaled(orbit%monodromy(), s)
         length = norm2(matrix)
         error = (1 + orbit%sequence%count)*rounding_of_event + orbit%correction
         error = length*max(problem%resolution, error) + all_ways*orbit%bend*error
         call right_eigen(matrix, values, info, right, left)
         if (info /= 0) values = cmplx(huge(1.0_wp), 0.0_wp, wp)
         orbit%multiplier = values
         orbit%doubt = [(error, k=1, n)]
         if (info == 0) orbit%doubt = min(error/max(abs(sum(conjg(left)*right, dim=1)), tiny(1.0_wp)), &
                                          error + sqrt(error*length))
         do i = 1, merge(size(orbit%held, 2), 0, info == 0)
            k = minloc(abs(orbit%multiplier - 1.0_wp), 1, orbit%doubt > 0.0_wp)
            orbit%multiplier(k) = 1.0_wp
            orbit%doubt(k) = 0.0_wp
         end do
         if (.not. problem%is_autonomous()) return
         k = minloc(abs(values - 1.0_wp), dim=1)
         orbit%multiplier = [values(:k - 1), values(k + 1:)]
         orbit%doubt = [orbit%doubt(:k - 1), orbit%doubt(k + 1:)]
      end associate
   end subroutine find_multipliers

end module razy_orbits_periodic_multipliers
