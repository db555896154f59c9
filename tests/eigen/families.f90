!! Families of machines for the tests of modes and tuning.
module families
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_eigen_mode_branches, only: machines_t
   implicit none(type, external)
   private

   public :: linear_family_t, press_block, symmetric_pair, veering_pair

   !> M = mass + p mass_slope, K = stiffness + p stiffness_slope. `refused` and beyond there is no machine.
   type, extends(machines_t) :: linear_family_t
      real(wp), allocatable :: mass(:, :), mass_slope(:, :), stiffness(:, :), stiffness_slope(:, :)
      real(wp) :: refused = huge(1.0_wp)
      !> Machines made so far.
      integer :: made = 0
   contains
      procedure :: matrices
   end type linear_family_t

contains

   !> The machine at a parameter.
   subroutine matrices(self, parameter, mass, stiffness, error)
      class(linear_family_t), intent(inout) :: self
      real(wp), intent(in) :: parameter
      real(wp), allocatable, intent(out) :: mass(:, :), stiffness(:, :)
      type(error_t), allocatable, intent(out) :: error

      self%made = self%made + 1
      mass = self%mass + parameter*self%mass_slope
      stiffness = self%stiffness + parameter*self%stiffness_slope
      if (parameter >= self%refused) call raise(error, "refused")
   end subroutine matrices

   !> Unit masses on springs p and `other`, with a coupling -c: values (p + other)/2 ± sqrt(((p - other)/2)² + c²).
   function veering_pair(other, c) result(family)
      real(wp), intent(in) :: other, c
      type(linear_family_t) :: family

      family = blank(2)
      family%mass = diagonal([1.0_wp, 1.0_wp])
      family%stiffness = reshape([0.0_wp, -c, -c, other], [2, 2])
      family%stiffness_slope = diagonal([1.0_wp, 0.0_wp])
   end function veering_pair

   !> Two masses m on springs k, joined by a spring p, both joined to a third mass m on a spring k by springs k: the value of the
   !> antisymmetric mode is (2k + 2p)/m, those of the symmetric modes (5 ± sqrt 9)/2 k/m = k/m and 4k/m, whatever p is.
   function symmetric_pair(m, k) result(family)
      real(wp), intent(in) :: m, k
      type(linear_family_t) :: family

      family = blank(3)
      family%mass = diagonal([m, m, m])
      family%stiffness = k*reshape([2.0_wp, 0.0_wp, -1.0_wp, 0.0_wp, 2.0_wp, -1.0_wp, -1.0_wp, -1.0_wp, 3.0_wp], [3, 3])
      family%stiffness_slope(:2, :2) = reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
   end function symmetric_pair

   !> The vertical block of the vibropress, table, pallet and mould, with the contacts as two-way springs (source thesis,
   !> 4.3); p is k1.
   function press_block() result(family)
      type(linear_family_t) :: family

      family = blank(3)
      family%mass = diagonal([1020.0_wp, 100.0_wp, 425.0_wp])
      family%stiffness = 1.0e7_wp*reshape([2.0_wp, -2.0_wp, 0.0_wp, -2.0_wp, 6.0_wp, -2.0_wp, 0.0_wp, -2.0_wp, 12.0_wp], [3, 3])
      family%stiffness_slope(1, 1) = 1.0_wp
   end function press_block

   function blank(n) result(family)
      integer, intent(in) :: n
      type(linear_family_t) :: family

      allocate (family%mass(n, n), family%mass_slope(n, n), family%stiffness(n, n), family%stiffness_slope(n, n), source=0.0_wp)
   end function blank

   pure function diagonal(values) result(matrix)
      real(wp), intent(in) :: values(:)
      real(wp) :: matrix(size(values), size(values))

      integer :: i

      matrix = 0.0_wp
      do i = 1, size(values)
         matrix(i, i) = values(i)
      end do
   end function diagonal

end module families
