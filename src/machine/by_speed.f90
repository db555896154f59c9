!! What of K and B grows with the speed of a rotation in a run-up: gyroscopic moments, circulatory terms, tables of bearings.
module razy_machine_by_speed
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: congruence_of
   use razy_linalg_speed_table, only: table_change, tabled_t
   implicit none(type, external)
   private

   public :: by_speed_t

   !> What K and B have more than at the `speed` of time 0, rad/s: (Omega - speed) times these matrices (n, n), and what tables say.
   type :: by_speed_t
      real(wp) :: speed = 0.0_wp
      real(wp), allocatable :: circulatory(:, :), gyroscopic(:, :)
      type(tabled_t), allocatable :: tabled(:)
   contains
      procedure :: times
      procedure :: projected
      procedure :: pattern
   end type by_speed_t

contains

   !> dK y + dB v (n) where the speed is by `gained` more than at time 0, or the derivative of dK and dB by the speed of an `order`.
   pure function times(self, gained, order, y, v) result(force)
      class(by_speed_t), intent(in) :: self
      real(wp), intent(in) :: gained, y(:), v(:)
      integer, intent(in) :: order
      real(wp) :: force(size(y))

      integer :: i

      force = 0.0_wp
      if (order < 2) force = merge(gained, 1.0_wp, order == 0)*(matmul(self%circulatory, y) + matmul(self%gyroscopic, v))
      do i = 1, size(self%tabled)
         associate (row => self%tabled(i)%row)
            force = force + matmul(matmul(change(.false.), matmul(row, y)) + matmul(change(.true.), matmul(row, v)), row)
         end associate
      end do

   contains

      pure function change(damping)
         logical, intent(in) :: damping
         real(wp) :: change(2, 2)

         associate (one => self%tabled(i))
            change = reshape(table_change(one%table, one%ratio, self%speed + gained, damping, order) - merge(1, 0, order == 0) &
                             *table_change(one%table, one%ratio, self%speed, damping, 0), [2, 2], order=[2, 1])
         end associate
      end function change

   end function times

   !> The same for coordinates x with y = `basis` x.
   function projected(self, basis)
      class(by_speed_t), intent(in) :: self
      real(wp), contiguous, intent(in) :: basis(:, :)
      type(by_speed_t) :: projected

      integer :: i

      projected%speed = self%speed
      projected%circulatory = congruence_of(self%circulatory, basis)
      projected%gyroscopic = congruence_of(self%gyroscopic, basis)
      projected%tabled = self%tabled
      do i = 1, size(self%tabled)
         projected%tabled(i)%row = matmul(self%tabled(i)%row, basis)
      end do
   end function projected

   !> Entries (n, n) that are not 0 where K or B ever change.
   pure function pattern(self) result(entries)
      class(by_speed_t), intent(in) :: self
      real(wp), allocatable :: entries(:, :)

      integer :: i

      entries = abs(self%circulatory) + abs(self%gyroscopic)
      do i = 1, size(self%tabled)
         associate (felt => sum(abs(self%tabled(i)%row), dim=1))
            entries = entries + spread(felt, 1, size(felt))*spread(felt, 2, size(felt))
         end associate
      end do
   end function pattern

end module razy_machine_by_speed
