!! Values over a speed, interpolated between those of a table by piecewise cubics that are monotone where the values are (slopes of
!! Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984), in the form of Fritsch's PCHIP): no overshoot, and a continuous slope.
module razy_linalg_speed_table
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: new_speed_table, of_damping, of_stiffness, speed_table_t, table_change, tabled_t

   !> Of the columns of a bearing's table, which are the rows of the 2 x 2 matrices of stiffness and damping.
   integer, parameter :: of_stiffness(4) = [1, 2, 3, 4], of_damping(4) = [5, 6, 7, 8]

   !> Rising speeds, rad/s (speeds, at least two), values and their slopes (columns, speeds).
   type :: speed_table_t
      real(wp), allocatable :: speed(:), value(:, :)
      real(wp), allocatable, private :: slope(:, :)
   contains
      procedure :: at
   end type speed_table_t

   !> A bearing with a table over |ratio Omega|: v and w of its node are row y (2, p).
   type :: tabled_t
      type(speed_table_t) :: table
      real(wp) :: ratio = 1.0_wp
      real(wp), allocatable :: row(:, :)
   end type tabled_t

contains

   !> The table of `value` (columns, speeds) at rising speeds.
   pure function new_speed_table(speed, value) result(table)
      real(wp), intent(in) :: speed(:), value(:, :)
      type(speed_table_t) :: table

      real(wp) :: secant(size(value, 1), size(speed) - 1), step(size(speed) - 1)
      integer :: i, n

      n = size(speed)
      table%speed = speed
      table%value = value
      step = speed(2:) - speed(:n - 1)
      do i = 1, n - 1
         secant(:, i) = (value(:, i + 1) - value(:, i))/step(i)
      end do
      allocate (table%slope(size(value, 1), n))
      if (n == 2) then
         table%slope = spread(secant(:, 1), 2, 2)
         return
      end if
      do i = 2, n - 1
         table%slope(:, i) = between(step(i - 1), step(i), secant(:, i - 1), secant(:, i))
      end do
      table%slope(:, 1) = at_end(step(1), step(2), secant(:, 1), secant(:, 2))
      table%slope(:, n) = at_end(step(n - 1), step(n - 2), secant(:, n - 1), secant(:, n - 2))
   end function new_speed_table

   !> The slope between two secants: their weighted harmonic mean; none at an extremum.
   elemental function between(step_1, step_2, secant_1, secant_2) result(slope)
      real(wp), intent(in) :: step_1, step_2, secant_1, secant_2
      real(wp) :: slope

      slope = 0.0_wp
      if (secant_1*secant_2 > 0.0_wp) slope = 3*(step_1 + step_2)/((2*step_2 + step_1)/secant_1 + (step_2 + 2*step_1)/secant_2)
   end function between

   !> The slope at an end, of the parabola through three values as far as it stays monotone; the first secant is the outer one.
   elemental function at_end(step_1, step_2, secant_1, secant_2) result(slope)
      real(wp), intent(in) :: step_1, step_2, secant_1, secant_2
      real(wp) :: slope

      slope = ((2*step_1 + step_2)*secant_1 - step_1*secant_2)/(step_1 + step_2)
      if (slope*secant_1 <= 0.0_wp) then
         slope = 0.0_wp
      else if (secant_1*secant_2 <= 0.0_wp .and. abs(slope) > 3*abs(secant_1)) then
         slope = 3*secant_1
      end if
   end function at_end

   !> Values (columns) at a speed, rad/s, or their derivatives by it of an `order`; beyond the ends those there, and none.
   pure function at(self, speed, order) result(found)
      class(speed_table_t), intent(in) :: self
      real(wp), intent(in) :: speed
      integer, intent(in) :: order
      real(wp), allocatable :: found(:)

      real(wp) :: h, x
      integer :: i

      associate (n => size(self%speed))
         i = min(max(1, count(self%speed <= speed)), n - 1)
         h = self%speed(i + 1) - self%speed(i)
         x = (min(max(speed, self%speed(1)), self%speed(n)) - self%speed(i))/h
         if (order == 0) then
            found = (1 - x)**2*((1 + 2*x)*self%value(:, i) + h*x*self%slope(:, i)) &
                    + x**2*((3 - 2*x)*self%value(:, i + 1) - h*(1 - x)*self%slope(:, i + 1))
         else if (speed < self%speed(1) .or. speed > self%speed(n) .or. order > 3) then
            found = spread(0.0_wp, 1, size(self%value, 1))
         else if (order == 3) then
            found = 12/h**3*(self%value(:, i) - self%value(:, i + 1)) + 6/h**2*(self%slope(:, i) + self%slope(:, i + 1))
         else if (order == 2) then
            found = 6*(1 - 2*x)/h**2*(self%value(:, i + 1) - self%value(:, i)) &
                    + ((6*x - 4)*self%slope(:, i) + (6*x - 2)*self%slope(:, i + 1))/h
         else
            found = 6*x*(1 - x)/h*(self%value(:, i + 1) - self%value(:, i)) &
                    + (1 - x)*(1 - 3*x)*self%slope(:, i) + x*(3*x - 2)*self%slope(:, i + 1)
         end if
      end associate
   end function at

   !> What the table of a bearing on a shaft with the speed ratio `ratio` adds at the speed Omega of the system to the matrix
   !> of its first speed, of stiffness or `damping`: rows of (2, 2), N/m or N s/m; or its derivative by Omega of an `order`.
   pure function table_change(table, ratio, speed, damping, order) result(change)
      type(speed_table_t), intent(in) :: table
      real(wp), intent(in) :: ratio, speed
      logical, intent(in) :: damping
      integer, intent(in) :: order
      real(wp) :: change(4)

      integer :: column(4)

      column = merge(of_damping, of_stiffness, damping)
      associate (values => table%at(abs(ratio*speed), order))
         change = values(column)
      end associate
      change = sign(abs(ratio), speed)**order*change
      if (order == 0) change = change - table%value(column, 1)
   end function table_change

end module razy_linalg_speed_table
